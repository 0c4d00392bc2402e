#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "collision/geometry/box.hpp"

namespace nbd {

/// Covers the rounding of distances in double precision, relative to the lengths they come from.
inline constexpr double least_distance_slack = 1e-14;

/// Lower bound on the distance of two boxes, metres.
inline double least_distance(const Box& s, const Box& t) noexcept {
    double squared = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const double gap = std::max(double{s.lo[axis]} - t.hi[axis], double{t.lo[axis]} - s.hi[axis]);
        if (gap > 0) squared += gap * gap;
    }
    return std::sqrt(squared) * (1 - least_distance_slack);
}

/// Index of the box among boxes.box(0) to boxes.box(count - 1) that is nearest to t; the first of equally
/// near ones.
template <class Boxes>
int nearest_box(const Boxes& boxes, int count, const Box& t) noexcept {
    int nearest = 0;
    double least = std::numeric_limits<double>::infinity();
    for (int k = 0; k < count; ++k) {
        const double distance = least_distance(boxes.box(k), t);
        if (distance < least) {
            least = distance;
            nearest = k;
        }
    }
    return nearest;
}

}  // namespace nbd
