#pragma once

#include <array>

#include "collision/box.hpp"

namespace nbd {

/// The boxes of up to four faces, a lane each, so that one can be compared with four at once. Lanes without a
/// face are empty: far from every box.
struct FaceBoxes {
    static constexpr int lanes = 4;
    std::array<Eigen::Array4f, 3> lo, hi;  // [axis]

    FaceBoxes() : FaceBoxes({empty_box(), empty_box(), empty_box(), empty_box()}) {}

    /// One box a lane; their fourth numbers are ignored.
    explicit FaceBoxes(const std::array<Box, lanes>& boxes) noexcept {
        Eigen::Array44f low, high;
        for (std::size_t lane = 0; lane < lanes; ++lane) {
            low.col(static_cast<Eigen::Index>(lane)) = boxes[lane].lo;
            high.col(static_cast<Eigen::Index>(lane)) = boxes[lane].hi;
        }
        const Eigen::Array44f low_of_axis = low.transpose(), high_of_axis = high.transpose();
        for (std::size_t axis = 0; axis < 3; ++axis) {
            lo[axis] = low_of_axis.col(static_cast<Eigen::Index>(axis));
            hi[axis] = high_of_axis.col(static_cast<Eigen::Index>(axis));
        }
    }

    /// Squared gaps between the box in one lane of s and all of t's, as apart() computes them.
    friend Eigen::Array4f squared_gaps(const FaceBoxes& s, int lane, const FaceBoxes& t) noexcept {
        Eigen::Array4f squared = Eigen::Array4f::Zero();
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const Eigen::Array4f above = s.lo[axis][lane] - t.hi[axis], below = t.lo[axis] - s.hi[axis][lane];
            squared += above.max(below).max(0.f).square();
        }
        return squared;
    }
};

}  // namespace nbd
