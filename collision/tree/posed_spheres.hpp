#pragma once

#include <variant>

#include "collision/bounds/exact/exact_bound.hpp"
#include "collision/bounds/exact/exact_boxes.hpp"
#include "collision/bounds/learned/bd_bound.hpp"
#include "collision/bounds/learned/nbd_bound.hpp"
#include "collision/tree/leaf_boxes.hpp"
#include "collision/tree/sphere_cache.hpp"

namespace nbd {

/// A pose of the sphere tree, its bounds and the boxes under its leaves. Queries take the type of the bounds
/// out of the variant once and then run without a dispatch per node.
struct PosedSpheres {
    std::variant<ExactBound, ExactBoxes, BdBound, NbdBound> bounds;
    SphereCache spheres;
    LeafBoxes boxes;

    void begin_pose(const Positions& x) noexcept;
    int nodes_bounded() const noexcept;
    int nodes_out_of_range() const noexcept;
    /// Whether something that was read in this pose is not finite, or overflows.
    bool met_non_finite() const noexcept;
};

}  // namespace nbd
