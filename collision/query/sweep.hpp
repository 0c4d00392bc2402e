#pragma once

#include <compare>
#include <span>
#include <vector>

#include "collision/geometry/box.hpp"

namespace nbd {

/// Two bodies of a list, a < b.
struct BodyIndices {
    int a = 0, b = 0;
    auto operator<=>(const BodyIndices&) const = default;
};

/// Finds the boxes of a list that touch. Owns its scratch memory, so a warm call allocates nothing.
class Sweep {
 public:
    /// Pairs of boxes that touch, in ascending order; valid until the next call. Sweep and prune: sorts the
    /// boxes along the axis on which their centres spread furthest and compares those with overlapping
    /// intervals. Empty boxes touch nothing.
    std::span<const BodyIndices> touching(std::span<const Box> boxes);

    /// Makes room for so many boxes and pairs.
    void reserve(std::size_t boxes, std::size_t pairs) {
        order_.reserve(boxes);
        pairs_.reserve(pairs);
    }

 private:
    std::vector<int> order_;
    std::vector<BodyIndices> pairs_;
};

}  // namespace nbd
