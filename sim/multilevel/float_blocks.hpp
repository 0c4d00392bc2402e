#pragma once

#include <cstddef>
#include <cstring>
#include <span>
#include <vector>

#include "meshing/parallel/parallel_for.hpp"
#include "sim/factor/block_pattern.hpp"
#include "sim/multilevel/block_sparse.hpp"

namespace nbd {

/// A sparse matrix of R x C blocks in single precision, by rows of blocks, for products.
template <int R, int C>
class FloatBlocks {
 public:
    static constexpr int lanes = R <= 4 ? 4 : 8;
    /// The R rows of a block row; the other lanes are unspecified.
    using Row [[gnu::vector_size(lanes * sizeof(float))]] = float;
    static_assert(R <= 8);

    FloatBlocks() = default;

    explicit FloatBlocks(const BlockSparse<R, C>& A) : offset_(A.offset), column_(A.column) {
        allocate();
        for (std::size_t k = 0; k < A.blocks.size(); ++k) set(k, A.blocks[k]);
    }

    /// Zeros with the blocks of a pattern.
    explicit FloatBlocks(const BlockPattern& pattern) {
        for (int i = 0; i < pattern.node_count(); ++i) {
            const auto row = pattern.neighbours(i);
            column_.insert(column_.end(), row.begin(), row.end());
            offset_.push_back(static_cast<int>(column_.size()));
        }
        allocate();
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
    template <class Values>
    void set(std::size_t k, const Values& values) noexcept {
        Eigen::Map<Eigen::Matrix<float, R, C>>(values_.data() + k * R * C) = values.template cast<float>();
    }

    /// out = this times x, in parallel. x: C numbers for each column of blocks; out: R for each row.
    void multiply(const float* x, float* out) const {
        parallel_for(
            rows(),
            [&](int i) {
                const Row row = times(i, x);
                std::memcpy(out + static_cast<std::ptrdiff_t>(R) * i, &row, R * sizeof(float));
            },
            64);
    }

    /// A block row times x, where x has C numbers for each column of blocks.
    Row times(int row, const float* x) const noexcept {
        Row sum[C] = {};
        const float* values = values_.data() + first_block(row) * R * C;
        for (const int column : columns_of(row)) {
            const float* part = x + static_cast<std::ptrdiff_t>(C) * column;
            for (int c = 0; c < C; ++c, values += R) {
                Row entries;
                std::memcpy(&entries, values, sizeof entries);  // beyond the block's rows too
                sum[c] += entries * part[c];
            }
        }
        for (int c = 1; c < C; ++c) sum[0] += sum[c];
        return sum[0];
    }

 private:
    void allocate() { values_.assign(column_.size() * R * C + lanes, 0.F); }  // room for the last load

    std::vector<int> offset_{0}, column_;
    std::vector<float> values_;  // blocks by columns
};

}  // namespace nbd
