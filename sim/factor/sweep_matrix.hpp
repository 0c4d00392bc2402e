#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <utility>

#include "sim/factor/lane_vector.hpp"
#include "sim/factor/sweep_order.hpp"

namespace nbd {

/// A symmetric sparse matrix of square blocks, stored in the order of Gauss-Seidel sweeps. Blocks:
/// FloatBlocks or ScaledBlocks.
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

    /// Sets the block of a row at its k-th column in ascending order.
    template <class Values>
    void set(int row, std::size_t k, const Values& values) noexcept {
        blocks_.set(slot(row, k), values);
    }

    /// Sets the diagonal block of a row.
    template <class Values>
    void set_diagonal(int row, const Values& values) noexcept {
        blocks_.set(first(row), values);
    }

    /// The block of a row at its k-th column in ascending order.
    auto block(int row, std::size_t k) const noexcept { return blocks_.block(slot(row, k)); }

    /// Calls visit(column, block) for the blocks of a row off the diagonal, in the order in which they are
    /// stored.
    template <class Visit>
    void for_each_other(int row, const Visit& visit) const {
        for (std::size_t k = first(row) + 1; k < first(row + 1); ++k)
            visit(order_->column[k], blocks_.block(k));
    }

    /// Row times x, [block_rows rows], over all columns.
    Row times(int row, const float* x) const noexcept { return part(first(row), first(row + 1), x); }
    /// Likewise over all but the diagonal, over the columns that are swept before the row, or after it.
    Row times_others(int row, const float* x) const noexcept {
        return part(first(row) + 1, first(row + 1), x);
    }
    Row times_earlier(int row, const float* x) const noexcept {
        return part(first(row) + 1, first_later(row), x);
    }
    Row times_later(int row, const float* x) const noexcept {
        return part(first_later(row), first(row + 1), x);
    }

 private:
    std::size_t slot(int row, std::size_t k) const noexcept {
        return first(row) + static_cast<std::size_t>(order_->place[first(row) + k]);
    }
    std::size_t first(int row) const noexcept {
        return static_cast<std::size_t>(order_->offset[static_cast<std::size_t>(row)]);
    }
    std::size_t first_later(int row) const noexcept {
        return first(row) + 1 + static_cast<std::size_t>(order_->earlier[static_cast<std::size_t>(row)]);
    }
    Row part(std::size_t begin, std::size_t end, const float* x) const noexcept {
        return blocks_.row_product(begin, std::span(order_->column).subspan(begin, end - begin), x);
    }

    std::shared_ptr<const SweepOrder> order_;
    Blocks blocks_;
};

}  // namespace nbd
