#pragma once

#include <array>
#include <cstddef>

#include "collision/box.hpp"
#include "collision/lane_mask.hpp"

namespace nbd {

/// Up to sixteen boxes, a lane each, so that one box is compared with all of them at once. Lanes without a
/// box hold an empty one: far from every box.
struct BoxPack {
    static constexpr int lanes = 16;
    using Lanes = Eigen::Array<float, lanes, 1>;
    std::array<Lanes, 3> lo, hi;  // [axis]

    BoxPack() noexcept {
        for (Lanes& axis : lo) axis.setConstant(empty_box().lo[0]);
        for (Lanes& axis : hi) axis.setConstant(empty_box().hi[0]);
    }

    void set(int lane, const Box& box) noexcept {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            lo[axis][lane] = box.lo[static_cast<Eigen::Index>(axis)];
            hi[axis][lane] = box.hi[static_cast<Eigen::Index>(axis)];
        }
    }
    Box box(int lane) const noexcept {
        return {{lo[0][lane], lo[1][lane], lo[2][lane], 0}, {hi[0][lane], hi[1][lane], hi[2][lane], 0}};
    }

    /// Moves every side outward, metres.
    void grow(float by) noexcept {
        for (Lanes& axis : lo) axis -= by;
        for (Lanes& axis : hi) axis += by;
    }
};

/// Bit k is set unless box k of s and t have no point in common.
inline unsigned overlapping(const BoxPack& s, const Box& t) noexcept {
    // Gaps are differences of float32 numbers, whose sign is exact.
    BoxPack::Lanes gap = (s.lo[0] - t.hi[0]).max(t.lo[0] - s.hi[0]);
    for (std::size_t axis = 1; axis < 3; ++axis) {
        const auto k = static_cast<Eigen::Index>(axis);
        gap = gap.max(s.lo[axis] - t.hi[k]).max(t.lo[k] - s.hi[axis]);
    }
    return not_above(gap, 0);
}

/// Bit k is set unless the squared gap between t and box k of s is more than `most`; but for a few ulp, which
/// certain_square() covers.
inline unsigned near(const BoxPack& s, const Box& t, float most) noexcept {
    BoxPack::Lanes squared = BoxPack::Lanes::Zero();
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto k = static_cast<Eigen::Index>(axis);
        squared += (s.lo[axis] - t.hi[k]).max(t.lo[k] - s.hi[axis]).max(0.f).square();
    }
    return not_above(squared, most);
}

}  // namespace nbd
