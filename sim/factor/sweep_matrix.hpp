#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "sim/factor/block_row.hpp"
#include "sim/factor/sweep_order.hpp"

namespace nbd {

/// A symmetric sparse matrix of B x B blocks in single precision, stored in the order of Gauss-Seidel sweeps.
template <int B>
class SweepMatrix {
 public:
    using Row = LaneVector<B>;
    using Block = Eigen::Map<const Eigen::Matrix<float, B, B>>;

    SweepMatrix() = default;

    /// Zeros. order: of the pattern of the matrix.
    explicit SweepMatrix(std::shared_ptr<const SweepOrder> order)
        : order_(std::move(order)), values_(order_->column.size() * B * B + read_ahead<B>, 0.F) {}

    int rows() const noexcept { return order_->rows(); }
    const SweepOrder& order() const noexcept { return *order_; }

    /// Sets the block of a row at its k-th column in ascending order.
    template <class Values>
    void set(int row, std::size_t k, const Values& values) noexcept {
        write(slot(row, k), values);
    }

    /// Sets the diagonal block of a row.
    template <class Values>
    void set_diagonal(int row, const Values& values) noexcept {
        write(first(row) + earlier(row), values);
    }

    /// The block of a row at its k-th column in ascending order.
    Block block(int row, std::size_t k) const noexcept { return at(slot(row, k)); }

    /// Calls visit(column, block) for the blocks of a row off the diagonal, in the order of the sweep.
    template <class Visit>
    void for_each_other(int row, const Visit& visit) const {
        const std::size_t own = first(row) + earlier(row);
        for (std::size_t k = first(row); k < first(row + 1); ++k)
            if (k != own) visit(order_->column[k], at(k));
    }

    /// Row times x, [B rows], over all columns.
    Row times(int row, const float* x) const noexcept { return part(first(row), first(row + 1), x); }
    /// Likewise over the columns that are swept before the row, or after it.
    Row times_earlier(int row, const float* x) const noexcept {
        return part(first(row), first(row) + earlier(row), x);
    }
    Row times_later(int row, const float* x) const noexcept {
        return part(first(row) + earlier(row) + 1, first(row + 1), x);
    }

 private:
    std::size_t slot(int row, std::size_t k) const noexcept {
        return first(row) + static_cast<std::size_t>(order_->place[first(row) + k]);
    }
    template <class Values>
    void write(std::size_t k, const Values& values) noexcept {
        Eigen::Map<Eigen::Matrix<float, B, B>>(values_.data() + k * B * B) = values.template cast<float>();
    }
    Block at(std::size_t k) const noexcept { return Block(values_.data() + k * B * B); }
    std::size_t first(int row) const noexcept {
        return static_cast<std::size_t>(order_->offset[static_cast<std::size_t>(row)]);
    }
    std::size_t earlier(int row) const noexcept {
        return static_cast<std::size_t>(order_->earlier[static_cast<std::size_t>(row)]);
    }
    Row part(std::size_t begin, std::size_t end, const float* x) const noexcept {
        return row_product<B, B>(values_.data() + begin * B * B,
                                 std::span(order_->column).subspan(begin, end - begin), x);
    }

    std::shared_ptr<const SweepOrder> order_;
    std::vector<float> values_;  // blocks by columns
};

}  // namespace nbd
