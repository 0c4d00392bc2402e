#include "sim/factor/sweep_order.hpp"

#include <algorithm>
#include <array>
#include <cstddef>

namespace nbd {
namespace {

/// The least colour of each part that no coupled part before it has.
std::vector<int> colour_parts(std::span<const int> offset, std::span<const int> column, int rows_per_part) {
    const int rows = static_cast<int>(offset.size()) - 1;
    std::vector<int> colour;
    for (int begin = 0; begin < rows; begin += rows_per_part) {
        const int part = begin / rows_per_part, end = std::min(rows, begin + rows_per_part);
        std::vector<char> taken;
        for (int k = offset[static_cast<std::size_t>(begin)]; k < offset[static_cast<std::size_t>(end)];
             ++k) {
            const int other = column[static_cast<std::size_t>(k)] / rows_per_part;
            if (other >= part) continue;
            const auto c = static_cast<std::size_t>(colour[static_cast<std::size_t>(other)]);
            if (taken.size() <= c) taken.resize(c + 1, 0);
            taken[c] = 1;
        }
        colour.push_back(static_cast<int>(std::ranges::find(taken, 0) - taken.begin()));
    }
    return colour;
}

}  // namespace

SweepOrder::SweepOrder(std::span<const int> pattern_offset, std::span<const int> pattern_column,
                       int rows_per_part)
    : offset(pattern_offset.begin(), pattern_offset.end()),
      column(pattern_column.size()),
      place(pattern_column.size()) {
    const std::vector<int> colour = colour_parts(pattern_offset, pattern_column, rows_per_part);
    const int row_count = static_cast<int>(offset.size()) - 1;
    for (int p = 0; p < static_cast<int>(colour.size()); ++p) {
        const auto c = static_cast<std::size_t>(colour[static_cast<std::size_t>(p)]);
        if (colours.size() <= c) colours.resize(c + 1);
        colours[c].push_back({p * rows_per_part, std::min(row_count, (p + 1) * rows_per_part)});
    }
    const auto colour_of = [&](int row) { return colour[static_cast<std::size_t>(row / rows_per_part)]; };
    for (int i = 0; i < row_count; ++i) {
        const auto begin = static_cast<std::size_t>(offset[static_cast<std::size_t>(i)]);
        const auto end = static_cast<std::size_t>(offset[static_cast<std::size_t>(i) + 1]);
        const auto turn = [&](int j) {  // 0: before row i, 1: row i, 2: after it
            if (j == i) return std::size_t{1};
            const int own = colour_of(i), other = colour_of(j);
            return std::size_t{other < own || (other == own && j < i) ? 0U : 2U};
        };
        std::array<std::size_t, 3> next{};  // place of the next column of each kind
        for (std::size_t k = begin; k < end; ++k)
            for (std::size_t later = turn(pattern_column[k]) + 1; later < next.size(); ++later) ++next[later];
        earlier.push_back(static_cast<int>(next[1]));
        for (std::size_t k = begin; k < end; ++k) {
            const std::size_t at = next[turn(pattern_column[k])]++;
            place[k] = static_cast<int>(at);
            column[begin + at] = pattern_column[k];
        }
    }
}

}  // namespace nbd
