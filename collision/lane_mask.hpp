#pragma once

#include <Eigen/Core>
#include <bit>
#ifdef __AVX__
#include <immintrin.h>
#endif

namespace nbd {

/// Bit k is set where x[k] > limit; not for NaN.
inline unsigned above(const Eigen::Array<float, 8, 1>& x, float limit) noexcept {
#ifdef __AVX__
    const __m256 mask = _mm256_cmp_ps(_mm256_loadu_ps(x.data()), _mm256_set1_ps(limit), _CMP_GT_OQ);
    return static_cast<unsigned>(_mm256_movemask_ps(mask));
#else
    unsigned mask = 0;
    for (int k = 0; k < 8; ++k) mask |= static_cast<unsigned>(x[k] > limit) << k;
    return mask;
#endif
}

/// Calls f(k) for each bit k that is set, in ascending order.
template <class F>
void for_each_bit(unsigned mask, const F& f) {
    for (; mask != 0; mask &= mask - 1) f(std::countr_zero(mask));
}

}  // namespace nbd
