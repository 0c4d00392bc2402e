#pragma once

#include <algorithm>
#include <bit>
#include <utility>

#include "collision/geometry/box.hpp"
#include "collision/kernels/kernels.hpp"
#include "collision/kernels/packs.hpp"

namespace nbd {

inline BoxPack::BoxPack() noexcept {
    for (auto& axis : lo)
        for (float& side : axis) side = empty_box().lo[0];
    for (auto& axis : hi)
        for (float& side : axis) side = empty_box().hi[0];
}

inline void BoxPack::set(int lane, const Box& box) noexcept {
    for (int axis = 0; axis < 3; ++axis) {
        lo[axis][lane] = box.lo[axis];
        hi[axis][lane] = box.hi[axis];
    }
}

inline Box BoxPack::box(int lane) const noexcept {
    return {{lo[0][lane], lo[1][lane], lo[2][lane], 0}, {hi[0][lane], hi[1][lane], hi[2][lane], 0}};
}

inline void BoxPack::join(const BoxPack& other) noexcept {
    for (int axis = 0; axis < 3; ++axis)
        for (int lane = 0; lane < lanes; ++lane) {
            lo[axis][lane] = std::min(lo[axis][lane], other.lo[axis][lane]);
            hi[axis][lane] = std::max(hi[axis][lane], other.hi[axis][lane]);
        }
}

inline void BoxPack::grow(float by) noexcept {
    for (auto& axis : lo)
        for (float& side : axis) side -= by;
    for (auto& axis : hi)
        for (float& side : axis) side += by;
}

/// The eight numbers of a box, in the layout that kernels read.
inline const float* numbers(const Box& box) noexcept {
    static_assert(sizeof(Box) == 8 * sizeof(float));
    return reinterpret_cast<const float*>(&box);
}
inline float* numbers(Box& box) noexcept { return const_cast<float*>(numbers(std::as_const(box))); }

/// The box around the first `count` boxes of a pack, 1 to 16.
inline Box hull(const BoxPack& boxes, int count = BoxPack::lanes) noexcept {
    Box box;
    kernels().hull(boxes, count, numbers(box));
    return box;
}

/// Calls f(k) for each set bit k of a mask of lanes, in ascending order.
template <class F>
void for_each_bit(unsigned mask, const F& f) {
    for (; mask != 0; mask &= mask - 1) f(std::countr_zero(mask));
}

}  // namespace nbd
