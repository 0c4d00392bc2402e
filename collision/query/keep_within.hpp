#pragma once

#include <vector>

#include "collision/geometry/closest_points.hpp"

namespace nbd {

/// Keeps the pairs of faces whose triangles are at most `distance` apart, metres, in their order. a, b:
/// PosedFaces or AffineBoxes, as for keep_intersecting().
template <class Posed>
void keep_within(std::vector<FacePair>& pairs, const Posed& a, const Posed& b, float distance) noexcept {
    std::erase_if(pairs, [&](const FacePair& pair) {
        return !(triangle_distance(a.triangle(pair.a), b.triangle(pair.b)) <= double{distance});
    });
}

}  // namespace nbd
