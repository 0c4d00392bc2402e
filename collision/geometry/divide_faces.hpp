#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "collision/geometry/geometry.hpp"

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

/// Divides the faces of a surface into compact parts, at medians of their centroids in the rest pose.
/// Deterministic: ties are broken by the faces' numbers.
class FaceDivision {
 public:
    /// X: rest positions [n, 3]; F: faces [m, 3]. Throws std::invalid_argument on no faces, a vertex index
    /// out of range, or a position that is not finite.
    FaceDivision(VerticesRef X, FacesRef F);

    /// All faces, in an order that the functions below change.
    std::span<int> faces() noexcept { return faces_; }

    /// Moves the lower `count` of these faces, along the longest side of their centroids' box, to the front.
    void split(std::span<int> faces, std::size_t count) const { split_points(centroids_, faces, count); }

    /// Divides these faces into `parts` parts of equal size, give or take one face, and calls part() for each
    /// in order. parts: 1 to the number of faces.
    void divide(std::span<int> faces, int parts, const std::function<void(std::span<int>)>& part) const;

 private:
    Eigen::MatrixX3d centroids_;
    std::vector<int> faces_;
};

}  // namespace nbd
