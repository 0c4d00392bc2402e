#pragma once

#include <span>
#include <vector>

#include "collision/geometry/posed_faces.hpp"

namespace nbd {

/// The candidates that intersect, sorted, without repeats, by the tests that PairQuery makes: every method of
/// the benchmark answers by the same ones.
std::span<const FacePair> sorted_intersecting(std::vector<FacePair>& candidates, const PosedFaces& a,
                                              const PosedFaces& b);

}  // namespace nbd
