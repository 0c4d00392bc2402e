#pragma once

#include <vector>

#include "collision/geometry/geometry.hpp"
#include "collision/geometry/posed_faces.hpp"

namespace nbd {

/// Keeps those of the pairs of faces whose triangles have a point in common, in their order: exactly
/// triangles_intersect(), sixteen pairs at a time wherever float32 arithmetic is certain.
void keep_intersecting(std::vector<FacePair>& pairs, const PosedFaces& a, const PosedFaces& b) noexcept;

}  // namespace nbd
