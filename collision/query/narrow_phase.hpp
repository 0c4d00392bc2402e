#pragma once

#include <vector>

#include "collision/geometry/geometry.hpp"
#include "collision/geometry/posed_faces.hpp"
#include "collision/wide_tree/posed_wide_tree.hpp"

namespace nbd {

/// Keeps the pairs of faces whose triangles have a point in common, in their order. Gives the same answers as
/// triangles_intersect(), but decides sixteen pairs at a time where float32 arithmetic is certain.
void keep_intersecting(std::vector<FacePair>& pairs, const PosedFaces& a, const PosedFaces& b) noexcept;
/// Likewise for pairs of slots whose leaves were asked for.
void keep_intersecting(std::vector<FacePair>& pairs, const PosedWideTree& a, const PosedWideTree& b) noexcept;

/// Keeps the pairs of faces whose triangles are at most `distance` apart, metres, in their order.
void keep_within(std::vector<FacePair>& pairs, const PosedFaces& a, const PosedFaces& b,
                 float distance) noexcept;
void keep_within(std::vector<FacePair>& pairs, const PosedWideTree& a, const PosedWideTree& b,
                 float distance) noexcept;

}  // namespace nbd
