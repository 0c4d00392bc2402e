#pragma once

#include "collision/geometry.hpp"

namespace nbd {

/// All positions of a pose, read as four floats each, so that they fit vector registers: x, y, z and, in the
/// fourth, something finite or not that must not be looked at.
class PaddedPositions {
 public:
    PaddedPositions() = default;
    /// x: referred to.
    explicit PaddedPositions(VerticesRef x) noexcept
        : x_(x.data()), stride_(x.outerStride()), last_(x.rows() - 1) {}

    Eigen::Array4f operator[](int vertex) const noexcept {
        const float* p = x_ + stride_ * vertex;
        if (vertex == last_) return {p[0], p[1], p[2], 0};  // nothing need come after
        return Eigen::Map<const Eigen::Array4f>(p);
    }

    Eigen::Map<const Eigen::Vector3f> point(int vertex) const noexcept {
        return Eigen::Map<const Eigen::Vector3f>(x_ + stride_ * vertex);
    }

 private:
    const float* x_ = nullptr;
    Eigen::Index stride_ = 0, last_ = -1;
};

}  // namespace nbd
