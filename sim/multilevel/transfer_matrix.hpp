#pragma once

#include <cstddef>
#include <cstring>
#include <span>
#include <vector>

#include "meshing/parallel/parallel_for.hpp"
#include "sim/factor/scaled_blocks.hpp"
#include "sim/multilevel/block_sparse.hpp"

namespace nbd {

/// A sparse matrix of R x C blocks in 16 bits, by rows of blocks, for products.
template <int R, int C>
class TransferMatrix {
 public:
    TransferMatrix() = default;

    explicit TransferMatrix(const BlockSparse<R, C>& A)
        : offset_(A.offset), column_(A.column), blocks_(A.blocks.size()) {
        for (std::size_t k = 0; k < A.blocks.size(); ++k) blocks_.set(k, A.blocks[k]);
    }

    int rows() const noexcept { return static_cast<int>(offset_.size()) - 1; }

    std::span<const int> columns_of(int row) const noexcept {
        return {column_.data() + offset_[row], column_.data() + offset_[static_cast<std::size_t>(row) + 1]};
    }

    /// Index of the first block of a row; those of its other columns follow.
    std::size_t first_block(int row) const noexcept { return offset_[row]; }

    Eigen::Matrix<float, R, C> block(std::size_t k) const noexcept { return blocks_.block(k); }

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
        return blocks_.row_product(first_block(row), columns_of(row), x);
    }

 private:
    std::vector<int> offset_{0}, column_;
    ScaledBlocks<R, C> blocks_;
};

}  // namespace nbd
