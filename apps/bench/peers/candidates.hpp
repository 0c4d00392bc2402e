#pragma once

#include <span>
#include <vector>

#include "collision/geometry/posed_faces.hpp"

namespace nbd {

/// The candidates that intersect, sorted, without repeats. Uses the tests of PairQuery, so that all methods
/// of the benchmark decide alike.
std::span<const FacePair> sorted_intersecting(std::vector<FacePair>& candidates, const PosedFaces& a,
                                              const PosedFaces& b);

}  // namespace nbd
