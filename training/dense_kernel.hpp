#pragma once

#include <cstddef>
#include <cstring>

/// The one matrix product that training a small network consists of, blocked for vector registers. Only
/// included by files that run it: what it compiles to depends on the instruction set.
namespace nbd::dense_kernel {

#if defined(__AVX512F__)
inline constexpr int lanes = 16, accumulators = 24;  // of 32 registers
#elif defined(__AVX__)
inline constexpr int lanes = 8, accumulators = 12;  // of 16
#else
inline constexpr int lanes = 4, accumulators = 12;
#endif
using Vec [[gnu::vector_size(4 * lanes), gnu::may_alias]] = float;

/// How the factors b(k, n) of multiply() lie: with `stride` floats between two n or between two k, and
/// adjacent in the other index. Known at compile time, so that a block needs few address registers.
enum class Adjacent { k, n };

/// One block of `N` columns of multiply(), kept in registers over all of `depth`.
template <int H, Adjacent adjacent, int N>
inline void multiply_block(const float* a, int depth, const float* b, std::ptrdiff_t stride,
                           const float* start, float* c) noexcept {
    constexpr int V = H / lanes;
    Vec sum[N][V];
#pragma GCC unroll 16
    for (int n = 0; n < N; ++n)
#pragma GCC unroll 16
        for (int v = 0; v < V; ++v) {
            sum[n][v] = Vec{};
            if (start) std::memcpy(&sum[n][v], start + v * lanes, sizeof(Vec));
        }
    const float* factor[N];
#pragma GCC unroll 16
    for (int n = 0; n < N; ++n) factor[n] = adjacent == Adjacent::n ? b + n : b + n * stride;
#pragma GCC unroll 1
    for (std::ptrdiff_t k = 0; k < depth; ++k) {
        Vec column[V];
#pragma GCC unroll 16
        for (int v = 0; v < V; ++v) std::memcpy(&column[v], a + k * H + v * lanes, sizeof(Vec));
#pragma GCC unroll 16
        for (int n = 0; n < N; ++n) {
            const float f = adjacent == Adjacent::n ? b[k * stride + n] : factor[n][k];
#pragma GCC unroll 16
            for (int v = 0; v < V; ++v) sum[n][v] += column[v] * f;
        }
    }
#pragma GCC unroll 16
    for (int n = 0; n < N; ++n)
#pragma GCC unroll 16
        for (int v = 0; v < V; ++v) std::memcpy(c + n * H + v * lanes, &sum[n][v], sizeof(Vec));
}

/// c[n][h] = start[h] + sum over k of a[k][h] * b(k, n). Each sum runs over k in ascending order whatever
/// the blocking, so the result does not depend on `columns`.
/// H: rows, a multiple of 16. a: [depth, H]. c: out, [columns, H], not overlapping the inputs. start: [H],
/// or null for 0. Dense layer: a = W column-major, b = inputs pose by pose (k adjacent). Its weight
/// gradient: a = deltas pose by pose, b = the same inputs (n adjacent). Its input gradient: a = W row-major,
/// b = deltas pose by pose (k adjacent).
template <int H, Adjacent adjacent>
void multiply(const float* a, int depth, const float* b, std::ptrdiff_t stride, int columns,
              const float* start, float* c) noexcept {
    static_assert(H % 16 == 0 && H <= 64);
    // A power of two, so that a block of adjacent factors starts where a cache line can.
    constexpr int fit = accumulators / (H / lanes);
    constexpr int block = fit >= 16 ? 16 : fit >= 8 ? 8 : fit >= 4 ? 4 : fit >= 2 ? 2 : 1;
    const std::ptrdiff_t step = adjacent == Adjacent::n ? 1 : stride;
    const int whole = columns / block * block;
    for (int n = 0; n < whole; n += block)
        multiply_block<H, adjacent, block>(a, depth, b + n * step, stride, start, c + n * H);
    for (int n = whole; n < columns; ++n)
        multiply_block<H, adjacent, 1>(a, depth, b + n * step, stride, start, c + n * H);
}

}  // namespace nbd::dense_kernel
