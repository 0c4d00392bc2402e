#pragma once

#include <Eigen/Core>
#include <bit>
#ifdef __AVX__
#include <immintrin.h>
#endif

namespace nbd {

/// Bit k is set where x[k] > limit; not for NaN.
inline unsigned above(const Eigen::Array<float, 16, 1>& x, float limit) noexcept {
#if defined(__AVX512F__)
    return _mm512_cmp_ps_mask(_mm512_loadu_ps(x.data()), _mm512_set1_ps(limit), _CMP_GT_OQ);
#elif defined(__AVX__)
    const auto half = [&](const float* values) {
        const __m256 mask = _mm256_cmp_ps(_mm256_loadu_ps(values), _mm256_set1_ps(limit), _CMP_GT_OQ);
        return static_cast<unsigned>(_mm256_movemask_ps(mask));
    };
    return half(x.data()) | half(x.data() + 8) << 8;
#else
    unsigned mask = 0;
    for (int k = 0; k < 16; ++k) mask |= static_cast<unsigned>(x[k] > limit) << k;
    return mask;
#endif
}

/// Bit k is set unless x[k] > limit.
inline unsigned not_above(const Eigen::Array<float, 16, 1>& x, float limit) noexcept {
#if defined(__AVX512F__)
    return _mm512_cmp_ps_mask(_mm512_loadu_ps(x.data()), _mm512_set1_ps(limit), _CMP_NGT_UQ);
#else
    return ~above(x, limit) & 0xffffu;
#endif
}

/// Calls f(k) for each bit k that is set, in ascending order.
template <class F>
void for_each_bit(unsigned mask, const F& f) {
    for (; mask != 0; mask &= mask - 1) f(std::countr_zero(mask));
}

}  // namespace nbd
