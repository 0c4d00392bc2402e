#pragma once

#include <span>
#include <vector>

#include "collision/geometry/box.hpp"

namespace nbd {

/// Boxes of fixed lists of points, computed from a pose on demand.
class PointBoxes {
 public:
    /// point_count: points in every pose.
    explicit PointBoxes(int point_count) : last_(3 * (point_count - 1)) {}

    /// Appends a list. points: without repeats, best ascending.
    void add(std::span<const int> points);

    /// Box of a list. x: [point_count, 3], contiguous.
    Box box(int list, const float* x) const noexcept;

    int size() const noexcept { return ends_.size(); }

 private:
    int last_;  // first float of the last point, stored apart because four floats cannot be read from it
    std::vector<int> floats_;     // first float of each point, list after list
    std::vector<int> ends_;       // end of each list in floats_
    std::vector<int> with_last_;  // lists that have the last point, ascending
};

}  // namespace nbd
