#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <cstring>
#include <type_traits>
#include <vector>

#include "meshing/parallel/parallel_for.hpp"
#include "sim/factor/block_pattern.hpp"
#include "sim/factor/lane_blocks.hpp"
#include "sim/factor/sweep_matrix.hpp"

namespace nbd {

/// A sparse matrix of R x C blocks in double precision, by rows of blocks.
template <int R, int C>
struct BlockSparse : RowLists {
    using Block = Eigen::Matrix<double, R, C>;

    int columns = 0;  // number of columns of blocks
    std::vector<Block> blocks;

    const Block& block(int row, std::size_t k) const noexcept { return blocks[offset[row] + k]; }
};

template <int R, int C>
BlockSparse<C, R> transpose(const BlockSparse<R, C>& A) {
    BlockSparse<C, R> T{items_by_row(A.column, A.columns), A.rows(), {}};
    for (int& place : T.column) {
        T.blocks.push_back(A.blocks[place].transpose());
        place = std::ranges::upper_bound(A.offset, place) - A.offset.begin() - 1;
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
class TransferMatrix : public RowLists {
 public:
    TransferMatrix() = default;

    explicit TransferMatrix(const BlockSparse<R, C>& A) : RowLists(A), blocks_(A.blocks.size()) {
        for (std::size_t k = 0; k < A.blocks.size(); ++k) blocks_.set(k, A.blocks[k]);
    }

    Eigen::Matrix<float, R, C> block(int row, std::size_t k) const noexcept {
        return blocks_.block(offset[row] + k);
    }

    /// out = this times x, in some rows. x: C numbers for each column of blocks; out: R for each row.
    void multiply(RowRange rows, const float* x, float* out) const noexcept {
        for (int i = rows.begin; i < rows.end; ++i) {
            const LaneVector<R> row = times(i, x);
            std::memcpy(out + std::ptrdiff_t{R} * i, &row, R * sizeof(float));
        }
    }

    /// A block row times x, where x has C numbers for each column of blocks.
    LaneVector<R> times(int row, const float* x) const noexcept {
        return blocks_.row_product(offset[row], columns_of(row), x);
    }

 private:
    ScaledBlocks<R, C> blocks_;
};

/// The matrix of one body at a level, off the diagonal: of nodes (B = 3) as the step has it, of aggregates in
/// less memory.
template <int B>
using LevelMatrix = SweepMatrix<std::conditional_t<B == 3, FloatBlocks<B, B>, ScaledBlocks<B, B>>>;

}  // namespace nbd
