#pragma once

#include <vector>

#include "apps/view/posed_body.hpp"
#include "apps/view/view_scene.hpp"
#include "collision/bounds/affine/affine_boxes.hpp"

namespace nbd {

/// Bounds to which add_bounds() adds: of the nodes down to depth 6 of the sphere tree, or of levels of the
/// wide tree that the body's bounds walk, 512 boxes at most.
ViewBounds bounds_of(PosedBody& body);

/// Appends the bounds of a frame. body: in its pose.
void add_bounds(PosedBody& body, ViewBounds& bounds);

/// The boxes in a pose, level by level from the whole body down to leaves of some faces: as many levels as
/// have `most` boxes together, the first one always.
std::vector<std::vector<Box>> box_levels(AffineBoxes& boxes, std::size_t most);

}  // namespace nbd
