#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "collision/geometry/box.hpp"

namespace nbd {

/// Lists of nodes, around all of which boxes are made at once.
class NodeLists {
 public:
    NodeLists() = default;
    /// lists: places of the first coordinates of nodes. node_count: of all.
    NodeLists(std::span<const std::span<const std::int32_t>> lists, int node_count);

    /// Writes the box around each list; there is one at least. x: [node_count, 3]. Returns whether all
    /// numbers read are finite; if not, boxes mean nothing.
    bool boxes(const float* x, std::span<Box> boxes) const noexcept;

    std::size_t bytes() const noexcept;

 private:
    std::vector<std::int32_t> places_, counts_;  // see Kernels::boxes_of_lists
    std::vector<int> at_end_;  // lists with the last node of all, which no number may follow in memory
    int last_ = 0;             // its place
};

}  // namespace nbd
