#include "sim/factor/sweep_matrix.hpp"

#include <algorithm>
#include <cstddef>

namespace nbd {
namespace {

/// The least colour of each part that no coupled part before it has.
std::vector<int> colour_parts(const RowLists& pattern, int rows_per_part) {
    const int rows = pattern.rows();
    std::vector<int> colour;
    for (int begin = 0; begin < rows; begin += rows_per_part) {
        const int part = begin / rows_per_part, end = std::min(rows, begin + rows_per_part);
        std::vector<char> taken;
        for (int k = pattern.offset[begin]; k < pattern.offset[end]; ++k) {
            const int other = pattern.column[k] / rows_per_part;
            if (other >= part) continue;
            const std::size_t c = colour[other];
            if (taken.size() <= c) taken.resize(c + 1, 0);
            taken[c] = 1;
        }
        colour.push_back(std::ranges::find(taken, 0) - taken.begin());
    }
    return colour;
}

}  // namespace

SweepOrder::SweepOrder(const RowLists& pattern, int rows_per_part)
    : offset(pattern.offset), place(pattern.column.size(), -1) {
    const std::vector<int> colour = colour_parts(pattern, rows_per_part);
    const int row_count = pattern.rows();
    for (int p = 0; p < std::ssize(colour); ++p) {
        const std::size_t c = colour[p];
        if (colours.size() <= c) colours.resize(c + 1);
        colours[c].push_back({p * rows_per_part, std::min(row_count, (p + 1) * rows_per_part)});
    }
    std::vector<int> turn(row_count);
    for (int next = 0; const auto& parts : colours)
        for (const RowRange& rows : parts)
            for (int i = rows.begin; i < rows.end; ++i) turn[i] = next++;
    for (const bool is_earlier : {true, false}) {
        std::vector<int>& first = is_earlier ? earlier : later;
        std::vector<int> entries;  // of a row in the pattern
        for (int i = 0; i < row_count; ++i) {
            first.push_back(column.size());
            const auto turn_of = [&](int entry) { return turn[pattern.column[entry]]; };
            const int own = turn[i];
            entries.clear();
            for (int k = offset[i]; k < offset[i + 1]; ++k)
                if (is_earlier ? turn_of(k) < own : turn_of(k) > own) entries.push_back(k);
            std::ranges::sort(entries, {}, [&](int k) { return is_earlier ? turn_of(k) : -turn_of(k); });
            for (const int k : entries) {
                place[k] = column.size();
                column.push_back(pattern.column[k]);
            }
        }
        first.push_back(column.size());
    }
}

}  // namespace nbd
