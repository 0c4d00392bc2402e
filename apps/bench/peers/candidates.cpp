#include "apps/bench/peers/candidates.hpp"

#include <algorithm>

#include "collision/query/keep_intersecting.hpp"

namespace nbd {

std::span<const FacePair> sorted_intersecting(std::vector<FacePair>& candidates, const PosedFaces& a,
                                              const PosedFaces& b) {
    keep_intersecting(candidates, a, b);
    std::ranges::sort(candidates);
    candidates.erase(std::unique(candidates.begin(), candidates.end()), candidates.end());
    return candidates;
}

}  // namespace nbd
