#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <span>
#include <utility>

namespace nbd {

/// Moves the lower `count` of some points, along the longest side of their box, to the front; ties by number.
/// points: [n, 3]; chosen: rows of it, at least one; count: at most as many as are chosen.
template <class Points>
void split_points(const Points& points, std::span<int> chosen, std::size_t count) {
    using Row = Eigen::Matrix<typename Points::Scalar, 1, 3>;
    Row lo = points.row(chosen[0]), hi = lo;
    for (const int i : chosen) {
        lo = lo.cwiseMin(points.row(i));
        hi = hi.cwiseMax(points.row(i));
    }
    Eigen::Index axis = 0;
    (hi - lo).maxCoeff(&axis);
    std::ranges::nth_element(chosen, chosen.begin() + static_cast<std::ptrdiff_t>(count), {},
                             [&](int i) { return std::pair(points(i, axis), i); });
}

}  // namespace nbd
