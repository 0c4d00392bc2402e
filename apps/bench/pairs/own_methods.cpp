#include "apps/bench/pairs/own_methods.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "apps/bench/pairs/lazy_boxes.hpp"
#include "collision/pair_query.hpp"

namespace nbd {
namespace {

class TreeMethod final : public PairMethod {
 public:
    TreeMethod(const std::shared_ptr<const CollisionTree>& tree, BoundKind kind)
        : a_(tree, kind), b_(tree, kind) {}

    void update(const BenchPose& a, const BenchPose& b) override {
        a_.begin_pose(a.x);
        b_.begin_pose(b.x);
    }
    std::span<const FacePair> query() override { return query_.intersecting(a_, b_); }

 private:
    PosedTree a_, b_;
    PairQuery query_;
};

class LazyBoxesMethod final : public PairMethod {
 public:
    LazyBoxesMethod(const LazyBoxes& boxes, bool over_nodes)
        : a_(boxes), b_(boxes), over_nodes_(over_nodes) {}

    void update(const BenchPose& a, const BenchPose& b) override {
        a_.begin_pose(over_nodes_ ? a.nodes : a.x);
        b_.begin_pose(over_nodes_ ? b.nodes : b.x);
    }
    std::span<const FacePair> query() override {
        intersecting_faces(a_, b_, pairs_);
        return pairs_;
    }
    std::size_t bytes() const override { return a_.bytes() + b_.bytes(); }

 private:
    LazyBoxes a_, b_;
    bool over_nodes_;
    std::vector<FacePair> pairs_;
};

/// Vectors of numbers, as they lie in memory.
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
            sum_ += lo.sum() + hi.sum();
        }
    }
    std::span<const FacePair> query() override { return {}; }

 private:
    volatile float sum_ = 0;  // so that the work is done
};

/// Levels of a tree whose leaves have at most so many faces.
int depth_of_leaves(int faces, int leaf_faces) {
    int depth = 0;
    while ((faces >> depth) > leaf_faces && depth < 20) ++depth;
    return depth;
}

}  // namespace

std::vector<PairMethodEntry> tree_methods(const BenchBody& body) {
    std::vector<PairMethodEntry> methods;
    for (const BoundKind kind : bound_kinds)
        if (has_bounds(*body.tree, kind))
            methods.push_back({std::string(name(kind)), !can_miss(kind), false, [kind](const BenchBody& b) {
                                   return std::make_unique<TreeMethod>(b.tree, kind);
                               }});
    return methods;
}

std::vector<PairMethodEntry> box_methods(const BenchBody& body, const std::vector<int>& clusters) {
    std::vector<PairMethodEntry> methods;
    for (const int leaf_faces : {16, 64})
        methods.push_back(
            {fmt::format("refitted boxes {}", leaf_faces), true, false, [leaf_faces](const BenchBody& b) {
                 const SurfaceBody& s = b.surface;
                 const SphereTreeConfig config{depth_of_leaves(b.faces(), leaf_faces), 1};
                 return std::make_unique<TreeMethod>(
                     std::make_shared<const CollisionTree>(make_exact_tree(s.X, s.F, config)),
                     BoundKind::boxes);
             }});
    for (const int faces : clusters)
        methods.push_back({fmt::format("lazy boxes {}", faces), true, false, [faces](const BenchBody& b) {
                               return std::make_unique<LazyBoxesMethod>(
                                   LazyBoxes(b.surface.X, b.surface.F, {faces}), false);
                           }});
    const SurfaceEmbedding& W = body.surface.W;
    if (std::all_of(W.valuePtr(), W.valuePtr() + W.nonZeros(), [](float w) { return w >= 0; }))
        for (const int faces : clusters)
            methods.push_back({fmt::format("cage boxes {}", faces), true, true, [faces](const BenchBody& b) {
                                   return std::make_unique<LazyBoxesMethod>(
                                       LazyBoxes(b.surface.X, b.surface.F, b.surface.W, {faces}), true);
                               }});
    return methods;
}

PairMethodEntry reading_alone() {
    return {"reading alone", false, false, [](const BenchBody&) { return std::make_unique<ReadingAlone>(); },
            false};
}

}  // namespace nbd
