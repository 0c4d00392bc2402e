#pragma once

#include <vector>

#include "collision/bounds/affine/affine_boxes.hpp"
#include "collision/geometry/geometry.hpp"
#include "collision/geometry/posed_faces.hpp"

namespace nbd {

/// Keeps the pairs of faces whose triangles have a point in common, in their order. Gives the same answers as
/// triangles_intersect(), but decides sixteen pairs at a time where float32 arithmetic is certain.
void keep_intersecting(std::vector<FacePair>& pairs, const PosedFaces& a, const PosedFaces& b) noexcept;
/// Likewise for pairs of slots whose leaves were asked for.
void keep_intersecting(std::vector<FacePair>& pairs, const AffineBoxes& a, const AffineBoxes& b) noexcept;

}  // namespace nbd
