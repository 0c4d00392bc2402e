#pragma once

#include <span>
#include <vector>

namespace nbd {

/// Consecutive rows begin .. end - 1.
struct RowRange {
    int begin, end;
};

/// An order of the rows of a symmetric sparse matrix for Gauss-Seidel sweeps: parts of consecutive rows, with
/// colours such that parts of the same colour are not coupled. Colours follow one another, as do the rows of
/// a part; the parts of a colour may be swept at once, with the same result [Adams01].
struct SweepOrder {
    /// offset, column: the pattern by rows, symmetric and with the full diagonal; the columns of a row
    /// ascend.
    SweepOrder(std::span<const int> offset, std::span<const int> column, int rows_per_part);

    int rows() const noexcept { return static_cast<int>(earlier.size()) - 1; }

    std::vector<std::vector<RowRange>> colours;  // parts of each colour
    std::vector<int> offset;                     // that of the pattern
    /// Columns off the diagonal: those of all rows that are swept before the row, by their turn, then those
    /// of all rows that are swept after it, the last turn first. So a sweep reads one half of the matrix
    /// after the other, and of each row last what it has just computed.
    std::vector<int> column;
    std::vector<int> earlier, later;  // [rows + 1] ranges of `column`
    std::vector<int> place;           // for each entry of the pattern, its place among `column`; -1: diagonal
};

}  // namespace nbd
