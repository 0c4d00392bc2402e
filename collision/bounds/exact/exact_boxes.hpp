#pragma once

#include <vector>

#include "collision/bounds/bound.hpp"
#include "collision/geometry/box.hpp"
#include "collision/geometry/positions.hpp"
#include "collision/topology/sphere_tree.hpp"

namespace nbd {

/// Every node's axis-aligned box from the vertices themselves at each pose: exact, and as cheap as anything
/// that reads every vertex. One pass over the leaves' vertices, then the boxes are joined upwards.
class ExactBoxes {
 public:
    /// tree: referred to.
    explicit ExactBoxes(const SphereTree& tree);
    /// x: all of them required before.
    void begin_pose(const Positions& x) noexcept;

    /// The smallest box around the node's vertices.
    const Box& box(int node) const noexcept { return boxes_[static_cast<std::size_t>(node)]; }

    /// The sphere around that box.
    Sphere bound(int node) const noexcept;

 private:
    struct Leaf {
        int node;
        std::size_t begin, end;  // of rows_
    };

    const SphereTree* tree_;
    std::vector<Leaf> leaves_;
    std::vector<int> rows_;  // vertices of the leaves, ascending in each of them
    std::vector<Box> boxes_;
};

}  // namespace nbd
