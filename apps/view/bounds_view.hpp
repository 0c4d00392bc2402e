#pragma once

#include <vector>

#include "apps/view/posed_body.hpp"
#include "apps/view/view_scene.hpp"
#include "collision/wide_tree/posed_wide_tree.hpp"

namespace nbd {

/// Bounds to which add_bounds() adds: spheres of the nodes down to depth 6, or boxes of levels of the wide
/// tree, 512 at most.
ViewBounds bounds_of(PosedBody& body);

/// Appends the bounds of a frame. body: in its pose.
void add_bounds(PosedBody& body, ViewBounds& bounds);

/// The boxes in a pose, level by level from the whole body down to leaves of some faces: as many levels as
/// have `most` boxes together, the first one always.
std::vector<std::vector<Box>> box_levels(PosedWideTree& boxes, std::size_t most);

}  // namespace nbd
