#include <fmt/format.h>

#include "apps/bench/pairs/lazy_boxes.hpp"
#include "apps/bench/pairs/pair_method.hpp"
#include "collision/query/pair_query.hpp"

namespace nbd {
namespace {

/// Bounds of the body's tree, through PosedTree and PairQuery. Affine boxes read the nodes alone.
class TreeMethod final : public PairMethod {
 public:
    TreeMethod(const std::shared_ptr<const CollisionTree>& tree, BoundKind kind)
        : reads_nodes_(kind == BoundKind::affine), a_(tree, kind), b_(tree, kind) {}

    void update(const BenchPose& a, const BenchPose& b) override {
        begin(a_, a);
        begin(b_, b);
    }
    std::span<const FacePair> query() override { return query_.intersecting(a_, b_); }

 private:
    void begin(PosedTree& tree, const BenchPose& pose) const {
        if (reads_nodes_)
            tree.begin_pose_of_nodes(VertexView::as_long_as(pose.nodes));
        else
            tree.begin_pose(VertexView::as_long_as(pose.x));
    }

    bool reads_nodes_;
    PosedTree a_, b_;
    PairQuery query_;
};

class LazyBoxesMethod final : public PairMethod {
 public:
    LazyBoxesMethod(const BenchBody& body, int cluster_faces)
        : a_(body.surface.X, body.surface.F, cluster_faces), b_(a_) {}

    void update(const BenchPose& a, const BenchPose& b) override {
        a_.begin_pose(VertexView::as_long_as(a.x));
        b_.begin_pose(VertexView::as_long_as(b.x));
    }
    std::span<const FacePair> query() override {
        intersecting_faces(a_, b_, pairs_);
        return pairs_;
    }

 private:
    LazyBoxes a_, b_;
    std::vector<FacePair> pairs_;
};

}  // namespace

PairMethodEntry tree_method(BoundKind kind) {
    return {.name = std::string(name(kind)),
            .exact = is_exact(kind) || kind == BoundKind::affine,
            .reads_nodes = kind == BoundKind::affine,
            .make = [kind](const BenchBody& body) { return std::make_unique<TreeMethod>(body.tree, kind); },
            .bounds = kind};
}

std::vector<PairMethodEntry> tree_methods(const BenchBody& body) {
    std::vector<PairMethodEntry> methods;
    for (const BoundKind kind : bound_kinds)
        if (has_bounds(*body.tree, kind)) methods.push_back(tree_method(kind));
    return methods;
}

PairMethodEntry lazy_boxes_method(int cluster_faces) {
    return {.name = fmt::format("lazy boxes {}", cluster_faces),
            .make = [cluster_faces](const BenchBody& body) {
                return std::make_unique<LazyBoxesMethod>(body, cluster_faces);
            }};
}

}  // namespace nbd
