#pragma once

#include <span>
#include <vector>

#include "collision/box.hpp"

namespace nbd {

/// Boxes of fixed lists of points as PointBoxes, all at once, in a single pass over the points in the order
/// of memory: each is added to the boxes of the lists it is in. Slower than list by list where the points lie
/// in a cache, faster where they do not and lists are scattered over them.
class StreamedBoxes {
 public:
    /// point_count: of every pose.
    StreamedBoxes(int point_count, const std::vector<std::vector<int>>& lists);

    /// Boxes of all lists. x: [point_count, 3], one after another. Valid until the next call.
    std::span<const Box> boxes(const float* x) noexcept;

 private:
    /// x, y, z, - and the same negated, so that one maximum serves both ends.
    using Ends = Eigen::Array<float, 8, 1>;
    static constexpr int copies = 4;  // points in turn, since a box's next maximum waits for the last one
    struct Entry {
        int first;  // float of the point
        int list;
    };

    void add(Ends& ends, const float* point) const noexcept;

    std::vector<Entry> entries_;  // by points; not the last point, from which four floats cannot be read
    std::vector<int> with_last_;  // lists that have that one
    int last_;                    // its first float
    std::vector<Ends> ends_;      // [lists * copies]
    std::vector<Box> boxes_;
};

}  // namespace nbd
