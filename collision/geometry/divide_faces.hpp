#pragma once

#include <functional>
#include <span>
#include <vector>

#include "collision/geometry/geometry.hpp"

namespace nbd {

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
    void split(std::span<int> faces, std::size_t count) const;

    /// Divides these faces into `parts` parts of equal size, give or take one face, and calls part() for each
    /// in order. parts: 1 to the number of faces.
    void divide(std::span<int> faces, int parts, const std::function<void(std::span<int>)>& part) const;

 private:
    Eigen::MatrixX3d centroids_;
    std::vector<int> faces_;
};

}  // namespace nbd
