#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "apps/bench/pairs/bench_body.hpp"

namespace nbd {

/// A body in a pose. Both arrays stay valid and in place until the next update().
struct BenchPose {
    VerticesRef x;      // [n, 3] surface
    VerticesRef nodes;  // [N, 3] tet nodes that carry the surface
};

/// One method to find the intersecting faces of two copies of a body, pose after pose. The benchmark times
/// both steps.
class PairMethod {
 public:
    virtual ~PairMethod() = default;

    /// Work on new poses before any query.
    virtual void update(const BenchPose& a, const BenchPose& b) = 0;

    /// The intersecting face pairs, sorted by (a, b), without repeats. Valid until the next call.
    virtual std::span<const FacePair> query() = 0;
};

/// A named method and a function that sets it up for a body.
struct PairMethodEntry {
    std::string name;
    bool exact = true;         // always finds all pairs
    bool reads_nodes = false;  // reads tet nodes and computes surface positions as needed
    std::function<std::unique_ptr<PairMethod>(const BenchBody&)> make;  // the body outlives the method
    std::optional<BoundKind> bounds{};  // of the body's tree; empty: it has its own
};

/// Method with bounds of the body's tree, through PosedTree and PairQuery.
PairMethodEntry tree_method(BoundKind kind);

/// One method for each kind of bounds that the tree has.
std::vector<PairMethodEntry> tree_methods(const BenchBody& body);

/// LazyBoxes over the surface.
PairMethodEntry lazy_boxes_method(int cluster_faces);

/// Embree's hierarchies, refitted from pose to pose; they find candidates, which the triangle test of
/// PairQuery decides. Empty if Embree was not found when the program was built.
std::vector<PairMethodEntry> embree_methods();

}  // namespace nbd
