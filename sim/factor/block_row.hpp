#pragma once

#include <cstddef>
#include <cstring>
#include <span>

namespace nbd {

/// R numbers for vector units; further lanes are unspecified.
template <int R>
using LaneVector[[gnu::vector_size((R <= 4 ? 4 : 8) * sizeof(float))]] = float;

/// Floats that products read beyond the last block.
template <int R>
constexpr int read_ahead = (R <= 4 ? 4 : 8);

/// The sum of R x C blocks times the parts of x at their columns, C numbers each. values: the blocks one
/// after the other, by columns.
template <int R, int C>
LaneVector<R> row_product(const float* values, std::span<const int> columns, const float* x) noexcept {
    static_assert(R <= 8);
    LaneVector<R> sum[C] = {};
    for (const int column : columns) {
        const float* part = x + static_cast<std::ptrdiff_t>(C) * column;
        for (int c = 0; c < C; ++c, values += R) {
            LaneVector<R> entries;
            std::memcpy(&entries, values, sizeof entries);  // beyond the block's rows too
            sum[c] += entries * part[c];
        }
    }
    for (int c = 1; c < C; ++c) sum[0] += sum[c];
    return sum[0];
}

}  // namespace nbd
