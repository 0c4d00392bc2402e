#pragma once

#include <array>
#include <cstddef>
#include <limits>
#ifdef __AVX512F__
#include <immintrin.h>
#endif

#include "collision/box.hpp"

namespace nbd {

/// Sixteen boxes, a lane each, so that one can be compared with all of them at once. Lanes without a box are
/// empty: they overlap nothing.
struct WideBoxes {
    static constexpr int lanes = 16;
    using Lanes = Eigen::Array<float, lanes, 1>;
    std::array<Lanes, 3> lo, hi;  // [axis]

    WideBoxes() {
        constexpr float inf = std::numeric_limits<float>::infinity();
        for (Lanes& axis : lo) axis.setConstant(inf);
        for (Lanes& axis : hi) axis.setConstant(-inf);
    }

    void set(int lane, const Box& box) noexcept {
        for (int axis = 0; axis < 3; ++axis) {
            lo[static_cast<std::size_t>(axis)][lane] = box.lo[axis];
            hi[static_cast<std::size_t>(axis)][lane] = box.hi[axis];
        }
    }
    Box get(int lane) const noexcept {
        return {{lo[0][lane], lo[1][lane], lo[2][lane], 0}, {hi[0][lane], hi[1][lane], hi[2][lane], 0}};
    }
    /// Moves every side outward, metres.
    void grow(float by) noexcept {
        for (Lanes& axis : lo) axis -= by;
        for (Lanes& axis : hi) axis += by;
    }

    /// Lanes whose boxes have a point in common with the box, a bit each; lane 0 is the lowest.
    unsigned overlapping(const Box& box) const noexcept {
        // Below 0 or 0 along every axis: the gaps are differences of float32 numbers, whose sign is exact.
        Lanes gap = (lo[0] - box.hi[0]).max(box.lo[0] - hi[0]);
        for (std::size_t axis = 1; axis < 3; ++axis)
            gap = gap.max(lo[axis] - box.hi[static_cast<Eigen::Index>(axis)])
                      .max(box.lo[static_cast<Eigen::Index>(axis)] - hi[axis]);
        return not_positive(gap);
    }

 private:
    static unsigned not_positive(const Lanes& values) noexcept {
#ifdef __AVX512F__
        return _mm512_cmp_ps_mask(_mm512_loadu_ps(values.data()), _mm512_setzero_ps(), _CMP_LE_OQ);
#else
        unsigned mask = 0;
        for (int lane = 0; lane < lanes; ++lane) mask |= static_cast<unsigned>(values[lane] <= 0) << lane;
        return mask;
#endif
    }
};

}  // namespace nbd
