#pragma once

#include <vector>

#include "collision/bounds/bound.hpp"
#include "collision/geometry/box.hpp"
#include "collision/geometry/positions.hpp"
#include "collision/topology/sphere_tree.hpp"

namespace nbd {

/// Axis-aligned boxes of all nodes, computed from the vertices in each pose: exact, and as cheap as any
/// method that reads every vertex. Makes one pass over the leaves' vertices, then joins the boxes upwards.
class ExactBoxes {
 public:
    /// tree: must outlive this object.
    explicit ExactBoxes(const SphereTree& tree);
    /// Call x.require_all() first.
    void begin_pose(const Positions& x) noexcept;

    /// The smallest box around the node's vertices.
    const Box& box(int node) const noexcept { return boxes_[node]; }

    /// Whether a position of this pose was not finite.
    bool met_non_finite() const noexcept { return met_non_finite_; }

    /// The sphere around that box.
    Sphere bound(int node) const noexcept;

 private:
    struct Leaf {
        int node;
        std::size_t begin, end;  // range of `rows_`
    };

    const SphereTree* tree_;
    std::vector<Leaf> leaves_;
    std::vector<int> rows_;  // vertices of the leaves, ascending within each leaf
    std::vector<Box> boxes_;
    bool met_non_finite_ = false;
};

}  // namespace nbd
