#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#if defined(__AVX512BF16__)
#include <immintrin.h>
#elif defined(__ARM_FEATURE_BF16_VECTOR_ARITHMETIC)
#include <arm_neon.h>
#endif

/// The matrix product that dominates the training of small networks, blocked for vector registers. Include it
/// only in files that run it, since the code depends on the instruction set.
namespace nbd::dense_kernel {

#if defined(__AVX512F__)
inline constexpr int lanes = 16, accumulators = 24;  // of 32 registers
#elif defined(__AVX__)
inline constexpr int lanes = 8, accumulators = 12;  // of 16
#elif defined(__aarch64__)
inline constexpr int lanes = 4, accumulators = 24;  // of 32
#else
inline constexpr int lanes = 4, accumulators = 12;
#endif
using Vec [[gnu::vector_size(4 * lanes), gnu::may_alias]] = float;

/// Two bfloat16 numbers adjacent along k, the first in the low half. Where the CPU multiplies such pairs,
/// multiply() takes them instead of floats: half the work, with 8-bit factors and float sums.
using Pair = std::uint32_t;
#if defined(__AVX512BF16__) || defined(__ARM_FEATURE_BF16_VECTOR_ARITHMETIC)
inline constexpr bool has_pairs = true;
#else
inline constexpr bool has_pairs = false;
#endif

/// out[i][h] = (rows[2 i][h], rows[2 i + 1][h]), rounded; rows from `count` on count as 0. rows: [count, H].
/// Defined only if has_pairs.
template <int H>
void pair_rows(const float* rows, int count, Pair* out) noexcept;

/// out[p][i] = (rows[p][2 i], rows[p][2 i + 1]), rounded. rows: [count, H], count even. Defined only if
/// has_pairs.
template <int H>
void pair_columns(const float* rows, int count, Pair* out) noexcept;

inline void add_product(Vec& sum, const Vec& column, float factor) noexcept { sum += column * factor; }
#if defined(__AVX512BF16__)
inline void add_product(Vec& sum, const Vec& column, Pair factor) noexcept {
    sum = (Vec)_mm512_dpbf16_ps((__m512)sum, (__m512bh)column, (__m512bh)_mm512_set1_epi32(factor));
}

template <int H>
void pair_rows(const float* rows, int count, Pair* out) noexcept {
    alignas(64) static constexpr std::uint16_t interleave[32] = {0,  16, 1,  17, 2,  18, 3,  19, 4,  20, 5,
                                                                 21, 6,  22, 7,  23, 8,  24, 9,  25, 10, 26,
                                                                 11, 27, 12, 28, 13, 29, 14, 30, 15, 31};
    const __m512i order = _mm512_load_si512(interleave);
    for (int i = 0; i < count; i += 2)
        for (int h = 0; h < H; h += lanes) {
            const __m512 first = _mm512_loadu_ps(rows + i * H + h),
                         second =
                             i + 1 < count ? _mm512_loadu_ps(rows + (i + 1) * H + h) : _mm512_setzero_ps();
            _mm512_storeu_si512(out + i / 2 * H + h,
                                _mm512_permutexvar_epi16(order, (__m512i)_mm512_cvtne2ps_pbh(second, first)));
        }
}

template <int H>
void pair_columns(const float* rows, int count, Pair* out) noexcept {
    for (int i = 0; i < count * H; i += 2 * lanes)
        _mm512_storeu_si512(out + i / 2, (__m512i)_mm512_cvtne2ps_pbh(_mm512_loadu_ps(rows + i + lanes),
                                                                      _mm512_loadu_ps(rows + i)));
}
#elif defined(__ARM_FEATURE_BF16_VECTOR_ARITHMETIC)
inline void add_product(Vec& sum, const Vec& column, Pair factor) noexcept {
    sum = (Vec)vbfdotq_f32((float32x4_t)sum, (bfloat16x8_t)column, (bfloat16x8_t)vdupq_n_u32(factor));
}

template <int H>
void pair_rows(const float* rows, int count, Pair* out) noexcept {
    for (int i = 0; i < count; i += 2)
        for (int h = 0; h < H; h += lanes) {
            const auto row = [&](int r) {
                const float32x4_t x = r < count ? vld1q_f32(rows + r * H + h) : vdupq_n_f32(0);
                return vreinterpret_u16_bf16(vcvt_bf16_f32(x));
            };
            const uint16x4x2_t pairs = vzip_u16(row(i), row(i + 1));
            vst1q_u32(out + i / 2 * H + h, vreinterpretq_u32_u16(vcombine_u16(pairs.val[0], pairs.val[1])));
        }
}

template <int H>
void pair_columns(const float* rows, int count, Pair* out) noexcept {
    for (int i = 0; i < count * H; i += 2 * lanes) {
        const bfloat16x8_t low = vcvtq_low_bf16_f32(vld1q_f32(rows + i));
        vst1q_u32(out + i / 2, vreinterpretq_u32_bf16(vcvtq_high_bf16_f32(low, vld1q_f32(rows + i + lanes))));
    }
}
#endif

/// Memory layout of the factors b(k, n) of multiply(): adjacent along one index, `stride` words apart along
/// the other. A compile-time constant, so that a block needs few address registers.
enum class Adjacent { k, n };

/// Operation on a sum before it is stored. `relu`: replaces negative sums by 0. `gate`: replaces the sum by 0
/// where the previous value of c is <= 0 (the derivative of ReLU).
enum class Finish { plain, relu, gate };

/// Computes one block of `N` columns of multiply(), kept in registers over all k. offset: of the block in
/// each piece.
template <int H, Adjacent adjacent, Finish finish, int N, class Word>
inline void multiply_block(const Word* a, std::span<const Word* const> pieces, int depth,
                           std::ptrdiff_t offset, std::ptrdiff_t stride, const float* start,
                           float* c) noexcept {
    constexpr int V = H / lanes;
    Vec sum[N][V];
#pragma GCC unroll 16
    for (int n = 0; n < N; ++n)
#pragma GCC unroll 16
        for (int v = 0; v < V; ++v) {
            sum[n][v] = Vec{};
            if (start) std::memcpy(&sum[n][v], start + v * lanes, sizeof(Vec));
        }
    for (const Word* piece : pieces) {
        const Word *b = piece + offset, *factor[N];
#pragma GCC unroll 16
        for (int n = 0; n < N; ++n) factor[n] = adjacent == Adjacent::n ? b + n : b + n * stride;
#pragma GCC unroll 1
        for (std::ptrdiff_t k = 0; k < depth; ++k) {
            Vec column[V];
#pragma GCC unroll 16
            for (int v = 0; v < V; ++v) std::memcpy(&column[v], a + k * H + v * lanes, sizeof(Vec));
#pragma GCC unroll 16
            for (int n = 0; n < N; ++n) {
                const Word f = adjacent == Adjacent::n ? b[k * stride + n] : factor[n][k];
#pragma GCC unroll 16
                for (int v = 0; v < V; ++v) add_product(sum[n][v], column[v], f);
            }
        }
        a += depth * H;
    }
#pragma GCC unroll 16
    for (int n = 0; n < N; ++n)
#pragma GCC unroll 16
        for (int v = 0; v < V; ++v) {
            Vec gate = sum[n][v];
            if constexpr (finish == Finish::gate) std::memcpy(&gate, c + n * H + v * lanes, sizeof(Vec));
            if constexpr (finish != Finish::plain) sum[n][v] = gate > 0 ? sum[n][v] : Vec{};
            std::memcpy(c + n * H + v * lanes, &sum[n][v], sizeof(Vec));
        }
}

/// c[n][h] = start[h] + sum over k of a[k][h] * b(k, n), followed by `finish`. Each sum runs over k in
/// ascending order whatever the blocking, so the result does not depend on `columns`. With pairs, k counts
/// pairs and * is the sum of two products.
/// H: rows, a multiple of 16. a: [k, H]. pieces: consecutive parts of b with `depth` k each. c: out,
/// [columns, H], must not overlap the inputs; with Finish::gate also an input. start: [H], or null for 0.
/// Dense layer: a = W column-major, b = inputs pose by pose (k adjacent). Its weight gradient: a = deltas
/// pose by pose, b = the same inputs (n adjacent). Its input gradient: a = W row-major, b = deltas pose by
/// pose (k adjacent).
template <int H, Adjacent adjacent, Finish finish = Finish::plain, class Word>
void multiply(const Word* a, std::span<const Word* const> pieces, int depth, std::ptrdiff_t stride,
              int columns, const float* start, float* c) noexcept {
    static_assert(H % 16 == 0 && H <= 64);
    // A power of two, so that blocks of adjacent factors are aligned to cache lines where possible.
    constexpr int fit = accumulators / (H / lanes);
    constexpr int block = fit >= 16 ? 16 : fit >= 8 ? 8 : fit >= 4 ? 4 : fit >= 2 ? 2 : 1;
    const std::ptrdiff_t step = adjacent == Adjacent::n ? 1 : stride;
    const int whole = columns / block * block;
    for (int n = 0; n < whole; n += block)
        multiply_block<H, adjacent, finish, block>(a, pieces, depth, n * step, stride, start, c + n * H);
    for (int n = whole; n < columns; ++n)
        multiply_block<H, adjacent, finish, 1>(a, pieces, depth, n * step, stride, start, c + n * H);
}

/// As above, with b in one piece.
template <int H, Adjacent adjacent, Finish finish = Finish::plain, class Word>
void multiply(const Word* a, int depth, const Word* b, std::ptrdiff_t stride, int columns, const float* start,
              float* c) noexcept {
    multiply<H, adjacent, finish, Word>(a, std::span<const Word* const>(&b, 1), depth, stride, columns, start,
                                        c);
}

/// sum[h] = sum over n of d[n][h]. d: [count, H], count even.
template <int H>
void add_rows(const float* d, int count, float* sum) noexcept {
    constexpr int V = H / lanes;
    Vec total[2][V] = {};
    for (int n = 0; n < count; n += 2)
#pragma GCC unroll 16
        for (int v = 0; v < 2 * V; ++v) {
            Vec x;
            std::memcpy(&x, d + n * H + v * lanes, sizeof(Vec));
            total[v / V][v % V] += x;
        }
    for (int v = 0; v < V; ++v) {
        total[0][v] += total[1][v];
        std::memcpy(sum + v * lanes, &total[0][v], sizeof(Vec));
    }
}

}  // namespace nbd::dense_kernel
