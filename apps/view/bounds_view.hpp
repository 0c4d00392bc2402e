#pragma once

#include "apps/view/view_scene.hpp"
#include "collision/tree/posed_tree.hpp"

namespace nbd {

/// Bounds to which add_bounds() adds: of the nodes down to depth 6 of a tree.
ViewBounds bounds_of(const PosedTree& tree);

/// Appends the bounds of a frame. tree: in its pose.
void add_bounds(PosedTree& tree, ViewBounds& bounds);

}  // namespace nbd
