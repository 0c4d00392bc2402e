#pragma once

#include <bit>

namespace nbd {

/// Calls f(k) for each set bit k, in ascending order.
template <class F>
void for_each_bit(unsigned mask, const F& f) {
    for (; mask != 0; mask &= mask - 1) f(std::countr_zero(mask));
}

}  // namespace nbd
