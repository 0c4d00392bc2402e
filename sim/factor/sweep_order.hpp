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

    int rows() const noexcept { return static_cast<int>(earlier.size()); }

    std::vector<std::vector<RowRange>> colours;  // parts of each colour
    std::vector<int> offset;                     // [rows + 1] range of columns
    /// Of each row: itself; those swept before it, by their turn; then the others, the last turn first. So a
    /// sweep in either direction reads last what it has just computed.
    std::vector<int> column;
    std::vector<int> earlier;  // [rows] number of columns swept before the row
    std::vector<int> place;    // for each ascending column of a row, its place among `column`
};

}  // namespace nbd
