#include "apps/bench/pairs/own_methods.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "apps/bench/pairs/lazy_boxes.hpp"
#include "collision/query/pair_query.hpp"

namespace nbd {
namespace {

class TreeMethod : public PairMethod {
 public:
    TreeMethod(const std::shared_ptr<const CollisionTree>& tree, BoundKind kind)
        : a_(tree, kind), b_(tree, kind) {}

    void update(const BenchPose& a, const BenchPose& b) override {
        a_.begin_pose(VertexView::as_long_as(a.x));
        b_.begin_pose(VertexView::as_long_as(b.x));
    }
    std::span<const FacePair> query() override { return query_.intersecting(a_, b_); }

 protected:
    PosedTree a_, b_;
    PairQuery query_;
};

/// Input of lazy boxes in a pose.
enum class Reads { surface, surface_from_nodes, nodes };

class LazyBoxesMethod final : public PairMethod {
 public:
    LazyBoxesMethod(const BenchBody& body, const LazyBoxesConfig& config, Reads reads)
        : W_(body.surface.W),
          a_(reads == Reads::nodes ? LazyBoxes(body.surface.X, body.surface.F, W_, config)
                                   : LazyBoxes(body.surface.X, body.surface.F, config)),
          b_(a_),
          reads_(reads) {}

    void update(const BenchPose& a, const BenchPose& b) override {
        if (reads_ == Reads::surface_from_nodes) {
            apply_embedding(W_, a.nodes, x_a_);
            apply_embedding(W_, b.nodes, x_b_);
            a_.begin_pose(x_a_);
            b_.begin_pose(x_b_);
        } else {
            a_.begin_pose(VertexView::as_long_as(reads_ == Reads::nodes ? a.nodes : a.x));
            b_.begin_pose(VertexView::as_long_as(reads_ == Reads::nodes ? b.nodes : b.x));
        }
    }
    std::span<const FacePair> query() override {
        intersecting_faces(a_, b_, pairs_);
        return pairs_;
    }

 private:
    const SurfaceEmbedding& W_;
    LazyBoxes a_, b_;
    Reads reads_;
    Vertices x_a_, x_b_;
    std::vector<FacePair> pairs_;
};

/// Affine boxes, which read the nodes alone.
class AffineMethod final : public TreeMethod {
 public:
    explicit AffineMethod(const BenchBody& body) : TreeMethod(body.tree, BoundKind::affine) {}

    void update(const BenchPose& a, const BenchPose& b) override {
        a_.begin_pose_of_nodes(VertexView::as_long_as(a.nodes));
        b_.begin_pose_of_nodes(VertexView::as_long_as(b.nodes));
    }
};

/// Reads whole vectors of numbers in memory order.
class ReadingAlone final : public PairMethod {
 public:
    void update(const BenchPose& a, const BenchPose& b) override {
        for (const VerticesRef& x : {a.x, b.x}) {
            using Block = Eigen::Array<float, 64, 1>;
            Block lo = Block::Zero(), hi = lo;
            const float *p = x.data(), *end = p + x.size();
            for (; end - p >= Block::SizeAtCompileTime; p += Block::SizeAtCompileTime) {
                lo = lo.min(Eigen::Map<const Block>(p));
                hi = hi.max(Eigen::Map<const Block>(p));
            }
            for (; p < end; ++p) lo[0] = std::min(lo[0], *p);
            sum_ = sum_ + lo.sum() + hi.sum();
        }
    }
    std::span<const FacePair> query() override { return {}; }

 private:
    volatile float sum_ = 0;  // keeps the compiler from dropping the work
};

/// The bounds of a tree that are timed with positions of its surface.
std::vector<BoundKind> raced_bounds(const CollisionTree& tree) {
    std::vector<BoundKind> kinds;
    for (const BoundKind kind : bound_kinds)
        if (has_bounds(tree, kind) && kind != BoundKind::affine) kinds.push_back(kind);
    return kinds;
}

}  // namespace

PairMethodEntry tree_method(BoundKind kind) {
    if (kind == BoundKind::affine)
        return {.name = "affine",
                .reads_nodes = true,
                .make = [](const BenchBody& body) { return std::make_unique<AffineMethod>(body); },
                .bounds = kind};
    return {.name = std::string(name(kind)),
            .exact = is_exact(kind),
            .make = [kind](const BenchBody& body) { return std::make_unique<TreeMethod>(body.tree, kind); },
            .bounds = kind};
}

std::vector<PairMethodEntry> tree_methods(const BenchBody& body) {
    std::vector<PairMethodEntry> methods;
    for (const BoundKind kind : raced_bounds(*body.tree)) methods.push_back(tree_method(kind));
    if (body.tree->affine) methods.push_back(tree_method(BoundKind::affine));
    return methods;
}

PairMethodEntry lazy_boxes_method(int cluster_faces) {
    return {fmt::format("lazy boxes {}", cluster_faces), true, false, [cluster_faces](const BenchBody& body) {
                return std::make_unique<LazyBoxesMethod>(body, LazyBoxesConfig{cluster_faces},
                                                         Reads::surface);
            }};
}

std::vector<PairMethodEntry> box_methods(const BenchBody& body, const std::vector<int>& clusters) {
    std::vector<PairMethodEntry> methods;
    for (const int faces : clusters) methods.push_back(lazy_boxes_method(faces));
    const auto over_nodes = [&](const char* name, Reads reads) {
        for (const int faces : clusters)
            methods.push_back(
                {fmt::format("{} {}", name, faces), true, true, [faces, reads](const BenchBody& b) {
                     return std::make_unique<LazyBoxesMethod>(b, LazyBoxesConfig{faces}, reads);
                 }});
    };
    over_nodes("lazy boxes from nodes", Reads::surface_from_nodes);
    const SurfaceEmbedding& W = body.surface.W;
    if (std::all_of(W.valuePtr(), W.valuePtr() + W.nonZeros(), [](float w) { return w >= 0; }))
        over_nodes("cage boxes", Reads::nodes);
    return methods;
}

PairMethodEntry reading_alone() {
    return {"reading alone", false, false, [](const BenchBody&) { return std::make_unique<ReadingAlone>(); },
            false};
}

}  // namespace nbd
