#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <cstring>
#include <numeric>
#include <span>
#include <type_traits>
#include <vector>

#include "meshing/parallel/parallel_for.hpp"
#include "sim/factor/lane_blocks.hpp"
#include "sim/factor/sweep_matrix.hpp"

namespace nbd {

/// A sparse matrix of R x C blocks in double precision, by rows of blocks. The columns of a row ascend.
template <int R, int C>
struct BlockSparse {
    using Block = Eigen::Matrix<double, R, C>;

    int columns = 0;  // number of columns of blocks
    std::vector<int> offset{0}, column;
    std::vector<Block> blocks;

    int rows() const noexcept { return offset.size() - 1; }
    std::span<const int> columns_of(int row) const noexcept {
        return {column.data() + offset[row], column.data() + offset[row + 1]};
    }
    const Block& block(int row, std::size_t k) const noexcept { return blocks[offset[row] + k]; }
    void end_row() { offset.push_back(column.size()); }
};

template <int R, int C>
BlockSparse<C, R> transpose(const BlockSparse<R, C>& A) {
    BlockSparse<C, R> T;
    T.columns = A.rows();
    T.offset.assign(A.columns + 1, 0);
    T.column.resize(A.column.size());
    T.blocks.resize(A.blocks.size());
    for (const int c : A.column) ++T.offset[c + 1];
    std::partial_sum(T.offset.begin(), T.offset.end(), T.offset.begin());
    std::vector<int> next(T.offset.begin(), T.offset.end() - 1);
    for (int r = 0; r < A.rows(); ++r) {
        const auto row = A.columns_of(r);
        for (std::size_t k = 0; k < row.size(); ++k) {
            const std::size_t at = next[row[k]]++;
            T.column[at] = r;
            T.blocks[at] = A.block(r, k).transpose();
        }
    }
    return T;
}

/// A B, in parallel; sums are added in a fixed order.
template <int R, int K, int C>
BlockSparse<R, C> product(const BlockSparse<R, K>& A, const BlockSparse<K, C>& B) {
    constexpr int rows_per_task = 256;
    const int tasks = (A.rows() + rows_per_task - 1) / rows_per_task;
    std::vector<BlockSparse<R, C>> parts(tasks);
    parallel_for(
        tasks,
        [&](int task) {
            BlockSparse<R, C>& part = parts[task];
            std::vector<int> place(B.columns, -1), columns;
            std::vector<typename BlockSparse<R, C>::Block> sums;
            const int end = std::min(A.rows(), (task + 1) * rows_per_task);
            for (int r = task * rows_per_task; r < end; ++r) {
                columns.clear();
                sums.clear();
                const auto row = A.columns_of(r);
                for (std::size_t k = 0; k < row.size(); ++k) {
                    const auto inner = B.columns_of(row[k]);
                    for (std::size_t l = 0; l < inner.size(); ++l) {
                        int& at = place[inner[l]];
                        if (at < 0) {
                            at = columns.size();
                            columns.push_back(inner[l]);
                            sums.push_back(BlockSparse<R, C>::Block::Zero());
                        }
                        sums[at].noalias() += A.block(r, k) * B.block(row[k], l);
                    }
                }
                std::ranges::sort(columns);
                for (const int c : columns) {
                    int& at = place[c];
                    part.column.push_back(c);
                    part.blocks.push_back(sums[at]);
                    at = -1;
                }
                part.end_row();
            }
        },
        1);
    BlockSparse<R, C> result;
    result.columns = B.columns;
    for (BlockSparse<R, C>& part : parts) {
        const int first = result.offset.back();
        for (std::size_t r = 1; r < part.offset.size(); ++r) result.offset.push_back(first + part.offset[r]);
        result.column.insert(result.column.end(), part.column.begin(), part.column.end());
        result.blocks.insert(result.blocks.end(), part.blocks.begin(), part.blocks.end());
        part = {};
    }
    return result;
}

/// A sparse matrix of R x C blocks in 16 bits, by rows of blocks, for products.
template <int R, int C>
class TransferMatrix {
 public:
    TransferMatrix() = default;

    explicit TransferMatrix(const BlockSparse<R, C>& A)
        : offset_(A.offset), column_(A.column), blocks_(A.blocks.size()) {
        for (std::size_t k = 0; k < A.blocks.size(); ++k) blocks_.set(k, A.blocks[k]);
    }

    int rows() const noexcept { return offset_.size() - 1; }

    std::span<const int> columns_of(int row) const noexcept {
        return {column_.data() + offset_[row], column_.data() + offset_[row + 1]};
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
                std::memcpy(out + std::ptrdiff_t{R} * i, &row, R * sizeof(float));
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

/// The matrix of one body at a level, off the diagonal: of nodes (B = 3) as the step has it, of aggregates in
/// less memory.
template <int B>
using LevelMatrix = SweepMatrix<std::conditional_t<B == 3, FloatBlocks<B, B>, ScaledBlocks<B, B>>>;

}  // namespace nbd
