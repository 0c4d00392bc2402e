#pragma once

#include <algorithm>
#include <iterator>
#include <span>
#include <vector>

#include "collision/geometry/geometry.hpp"

namespace nbd {

/// Number of exact face pairs that are not among the found ones. Both lists are sorted, without repeats.
inline long missing_pairs(std::span<const FacePair> exact, std::span<const FacePair> found) {
    std::vector<FacePair> missing;
    std::ranges::set_difference(exact, found, std::back_inserter(missing));
    return missing.size();
}

}  // namespace nbd
