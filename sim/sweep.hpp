#pragma once

#include <compare>
#include <span>
#include <vector>

#include "collision/box.hpp"

namespace nbd {

/// Two bodies of a list, a < b.
struct BodyIndices {
    int a = 0, b = 0;
    auto operator<=>(const BodyIndices&) const = default;
};

/// Pairs of boxes that touch, in ascending order. Sorts the boxes along the axis on which their centres
/// spread furthest and compares those whose intervals overlap: sweep and prune. Empty boxes touch nothing.
std::vector<BodyIndices> touching_boxes(std::span<const Box> boxes);

}  // namespace nbd
