#pragma once

#include <cstddef>
#include <cstring>
#include <span>
#include <vector>

#include "meshing/parallel/parallel_for.hpp"
#include "sim/factor/block_row.hpp"
#include "sim/multilevel/block_sparse.hpp"

namespace nbd {

/// A sparse matrix of R x C blocks in single precision, by rows of blocks, for products.
template <int R, int C>
class FloatBlocks {
 public:
    FloatBlocks() = default;

    explicit FloatBlocks(const BlockSparse<R, C>& A)
        : offset_(A.offset), column_(A.column), values_(A.blocks.size() * R * C + read_ahead<R>, 0.F) {
        for (std::size_t k = 0; k < A.blocks.size(); ++k)
            Eigen::Map<Eigen::Matrix<float, R, C>>(values_.data() + k * R * C) =
                A.blocks[k].template cast<float>();
    }

    int rows() const noexcept { return static_cast<int>(offset_.size()) - 1; }

    std::span<const int> columns_of(int row) const noexcept {
        return {column_.data() + offset_[static_cast<std::size_t>(row)],
                column_.data() + offset_[static_cast<std::size_t>(row) + 1]};
    }

    /// Index of the first block of a row; those of its other columns follow.
    std::size_t first_block(int row) const noexcept {
        return static_cast<std::size_t>(offset_[static_cast<std::size_t>(row)]);
    }

    using Block = Eigen::Map<const Eigen::Matrix<float, R, C>>;
    Block block(std::size_t k) const noexcept { return Block(values_.data() + k * R * C); }

    /// out = this times x, in parallel. x: C numbers for each column of blocks; out: R for each row.
    void multiply(const float* x, float* out) const {
        parallel_for(
            rows(),
            [&](int i) {
                const LaneVector<R> row = times(i, x);
                std::memcpy(out + static_cast<std::ptrdiff_t>(R) * i, &row, R * sizeof(float));
            },
            64);
    }

    /// A block row times x, where x has C numbers for each column of blocks.
    LaneVector<R> times(int row, const float* x) const noexcept {
        return row_product<R, C>(values_.data() + first_block(row) * R * C, columns_of(row), x);
    }

 private:
    std::vector<int> offset_{0}, column_;
    std::vector<float> values_;  // blocks by columns
};

}  // namespace nbd
