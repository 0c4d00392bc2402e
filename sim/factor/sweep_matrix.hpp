#pragma once

#include <cassert>
#include <cstddef>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "sim/factor/block_pattern.hpp"
#include "sim/factor/lane_blocks.hpp"

namespace nbd {

/// Consecutive rows begin .. end - 1.
struct RowRange {
    int begin, end;
};

/// An order of the rows of a symmetric sparse matrix for Gauss-Seidel sweeps: parts of consecutive rows, with
/// colours such that parts of the same colour are not coupled. Colours follow one another, as do the rows of
/// a part; the parts of a colour may be swept at once, with the same result [Adams01].
struct SweepOrder {
    /// pattern: symmetric and with the full diagonal.
    SweepOrder(const RowLists& pattern, int rows_per_part);

    int rows() const noexcept { return earlier.size() - 1; }

    std::vector<std::vector<RowRange>> colours;  // parts of each colour
    std::vector<int> offset;                     // that of the pattern
    /// Columns off the diagonal: those of all rows that are swept before the row, by their turn, then those
    /// of all rows that are swept after it, the last turn first. So a sweep reads one half of the matrix
    /// after the other, and of each row last what it has just computed.
    std::vector<int> column;
    std::vector<int> earlier, later;  // [rows + 1] ranges of `column`
    std::vector<int> place;           // for each entry of the pattern, its place among `column`; -1: diagonal
};

/// The blocks off the diagonal of a symmetric sparse matrix of square blocks, stored in the order of
/// Gauss-Seidel sweeps. Blocks: FloatBlocks or ScaledBlocks.
template <class Blocks>
class SweepMatrix {
 public:
    static constexpr int block_rows = Blocks::rows;
    static_assert(Blocks::rows == Blocks::columns);
    using Row = LaneVector<block_rows>;

    SweepMatrix() = default;

    /// Zeros. order: of the pattern of the matrix.
    explicit SweepMatrix(std::shared_ptr<const SweepOrder> order)
        : order_(std::move(order)), blocks_(order_->column.size()) {}

    int rows() const noexcept { return order_->rows(); }
    const SweepOrder& order() const noexcept { return *order_; }

    /// Sets the block of a row at its k-th column in ascending order, which must not be that of the diagonal.
    template <class Values>
    void set(int row, std::size_t k, const Values& values) noexcept {
        blocks_.set(slot(row, k), values);
    }

    /// Likewise, that block.
    auto block(int row, std::size_t k) const noexcept { return blocks_.block(slot(row, k)); }

    /// Calls visit(column, block) for the blocks of a row.
    template <class Visit>
    void for_each(int row, const Visit& visit) const {
        for (const auto [begin, end] : {range(order_->earlier, row), range(order_->later, row)})
            for (std::size_t k = begin; k < end; ++k) visit(order_->column[k], blocks_.block(k));
    }

    /// Row times x, [block_rows rows], over the columns that are swept before the row, or after it.
    Row times_earlier(int row, const float* x) const noexcept { return part(range(order_->earlier, row), x); }
    Row times_later(int row, const float* x) const noexcept { return part(range(order_->later, row), x); }

 private:
    struct Range {
        std::size_t begin, end;
    };
    static Range range(const std::vector<int>& first, int row) noexcept {
        const std::size_t begin = first[row], end = first[row + 1];
        return {begin, end};
    }
    std::size_t slot(int row, std::size_t k) const noexcept {
        const std::size_t first = order_->offset[row];
        assert(order_->place[first + k] >= 0);  // not the diagonal
        return order_->place[first + k];
    }
    Row part(Range range, const float* x) const noexcept {
        return blocks_.row_product(
            range.begin, std::span(order_->column).subspan(range.begin, range.end - range.begin), x);
    }

    std::shared_ptr<const SweepOrder> order_;
    Blocks blocks_;
};

}  // namespace nbd
