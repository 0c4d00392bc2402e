#pragma once

#include <array>
#include <cstddef>

#include "collision/box.hpp"
#include "collision/lane_mask.hpp"

namespace nbd {

/// Up to eight boxes, a lane each, so that one box is compared with all of them at once. Lanes without a box
/// hold an empty one: far from every box.
struct BoxPack {
    static constexpr int lanes = 8;
    using Lanes = Eigen::Array<float, lanes, 1>;
    std::array<Lanes, 3> lo, hi;  // [axis]

    BoxPack()
        : BoxPack(std::array<Box, lanes>{empty_box(), empty_box(), empty_box(), empty_box(), empty_box(),
                                         empty_box(), empty_box(), empty_box()}) {}

    /// One box a lane; their fourth numbers are ignored.
    explicit BoxPack(const std::array<Box, lanes>& boxes) noexcept {
        for (int half = 0; half < 2; ++half) {
            Eigen::Array44f low, high;
            for (int lane = 0; lane < 4; ++lane) {
                low.col(lane) = boxes[static_cast<std::size_t>(4 * half + lane)].lo;
                high.col(lane) = boxes[static_cast<std::size_t>(4 * half + lane)].hi;
            }
            const Eigen::Array44f low_of_axis = low.transpose(), high_of_axis = high.transpose();
            for (int axis = 0; axis < 3; ++axis) {
                lo[static_cast<std::size_t>(axis)].segment<4>(4 * half) = low_of_axis.col(axis);
                hi[static_cast<std::size_t>(axis)].segment<4>(4 * half) = high_of_axis.col(axis);
            }
        }
    }

    Box box(int lane) const noexcept {
        return {{lo[0][lane], lo[1][lane], lo[2][lane], 0}, {hi[0][lane], hi[1][lane], hi[2][lane], 0}};
    }
};

/// Bit k is set unless the squared gap between t and box k of s, as apart() computes it, is more than
/// `most`.
inline unsigned near(const BoxPack& s, const Box& t, float most) noexcept {
    BoxPack::Lanes squared = BoxPack::Lanes::Zero();
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto k = static_cast<Eigen::Index>(axis);
        squared += (s.lo[axis] - t.hi[k]).max(t.lo[k] - s.hi[axis]).max(0.f).square();
    }
    return ~above(squared, most) & ((1u << BoxPack::lanes) - 1);
}

}  // namespace nbd
