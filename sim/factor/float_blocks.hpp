#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "sim/factor/lane_vector.hpp"

namespace nbd {

/// R x C blocks in single precision, one after the other.
template <int R, int C>
class FloatBlocks {
 public:
    static constexpr int rows = R, columns = C;

    FloatBlocks() = default;
    /// Zeros.
    explicit FloatBlocks(std::size_t count) : values_(count * R * C + lanes_of<R>, 0.F) {}

    template <class Values>
    void set(std::size_t k, const Values& values) noexcept {
        Eigen::Map<Eigen::Matrix<float, R, C>>(values_.data() + k * R * C) = values.template cast<float>();
    }

    Eigen::Map<const Eigen::Matrix<float, R, C>> block(std::size_t k) const noexcept {
        return Eigen::Map<const Eigen::Matrix<float, R, C>>(values_.data() + k * R * C);
    }

    /// The sum of the blocks from the k-th times the parts of x at their columns, C numbers each.
    LaneVector<R> row_product(std::size_t k, std::span<const int> columns_of_x,
                              const float* x) const noexcept {
        const float* values = values_.data() + k * R * C;
        LaneVector<R> sum[C] = {};
        for (const int column : columns_of_x) {
            const float* part = x + static_cast<std::ptrdiff_t>(C) * column;
            for (int c = 0; c < C; ++c, values += R)
                sum[c] += load_lanes<LaneVector<R>>(values) * part[c];  // reads beyond the block's rows too
        }
        for (int c = 1; c < C; ++c) sum[0] += sum[c];
        return sum[0];
    }

 private:
    std::vector<float> values_;  // by columns
};

}  // namespace nbd
