#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <vector>

namespace nbd {

/// How many lanes of a vector register hold R numbers.
template <int R>
requires(R <= 8) constexpr int lanes_of = (R <= 4 ? 4 : 8);

/// R numbers for vector units; further lanes are unspecified.
template <int R>
using LaneVector [[gnu::vector_size(lanes_of<R> * sizeof(float))]] = float;

/// The lanes that are stored at an address.
template <class Lanes>
Lanes load_lanes(const void* at) noexcept {
    Lanes result;
    std::memcpy(&result, at, sizeof result);
    return result;
}

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
            const float* part = x + std::ptrdiff_t{C} * column;
            for (int c = 0; c < C; ++c, values += R)
                sum[c] += load_lanes<LaneVector<R>>(values) * part[c];  // reads beyond the block's rows too
        }
        for (int c = 1; c < C; ++c) sum[0] += sum[c];
        return sum[0];
    }

 private:
    std::vector<float> values_;  // by columns
};

/// R whole numbers for vector units, see LaneVector.
template <int R>
using WordVector [[gnu::vector_size(lanes_of<R> * sizeof(std::int32_t))]] = std::int32_t;

/// R x C blocks, one after the other, in about half the memory of single precision: whole numbers of 16 bits,
/// times a scale for each block. An entry is off by about 1/65534 of the largest one of its block at most, if
/// that is not below 1e-29. A block and its transpose are rounded alike.
template <int R, int C>
class ScaledBlocks {
 public:
    static constexpr int rows = R, columns = C;

    ScaledBlocks() = default;
    /// Zeros.
    explicit ScaledBlocks(std::size_t count) : words_(count * words + lanes_of<R>, 0) {}

    /// A block with a number that is not finite becomes NaN as a whole.
    template <class Values>
    void set(std::size_t k, const Values& values) noexcept {
        constexpr double most = 32767;
        const Eigen::Matrix<double, R, C> given = values.template cast<double>();
        const double step =
            given.allFinite() ? given.cwiseAbs().maxCoeff() / most : std::numeric_limits<double>::quiet_NaN();
        std::int32_t* block = words_.data() + k * words;
        block[0] = std::bit_cast<std::int32_t>(static_cast<float>(step / unit));
        for (int c = 0; c < C; ++c)
            for (int r = 0; r < R; ++r) {
                const double steps = step > 0 ? std::round(given(r, c) / step) : 0;
                const auto whole = static_cast<std::int32_t>(std::clamp(steps, -most, most));
                std::int32_t& word = block[1 + R * (c / 2) + r];
                word = c % 2 == 0 ? whole & ~upper : word | (whole * unit);
            }
    }

    Eigen::Matrix<float, R, C> block(std::size_t k) const noexcept {
        const std::int32_t* block = words_.data() + k * words;
        Eigen::Matrix<float, R, C> result;
        for (int c = 0; c < C; ++c)
            for (int r = 0; r < R; ++r) {
                const std::int32_t word = block[1 + R * (c / 2) + r];
                result(r, c) = static_cast<float>(c % 2 == 0 ? word << 16 : word & upper);
            }
        return std::bit_cast<float>(block[0]) * result;
    }

    /// The sum of the blocks from the k-th times the parts of x at their columns, C numbers each.
    LaneVector<R> row_product(std::size_t k, std::span<const int> columns_of_x,
                              const float* x) const noexcept {
        const std::int32_t* block = words_.data() + k * words;
        LaneVector<R> sum = {};
        for (const int column : columns_of_x) {
            const float* part = x + std::ptrdiff_t{C} * column;
            LaneVector<R> product = {};
            for (int c = 0; c < C; c += 2) {
                // Lanes beyond the rows hold what follows the column.
                const auto both = load_lanes<WordVector<R>>(block + 1 + R * (c / 2));
                product += __builtin_convertvector(both << 16, LaneVector<R>) * part[c];
                if (c + 1 < C) product += __builtin_convertvector(both & upper, LaneVector<R>) * part[c + 1];
            }
            sum += product * std::bit_cast<float>(block[0]);
            block += words;
        }
        return sum;
    }

 private:
    static constexpr std::int32_t unit = 1 << 16, upper = -unit;  // upper: a mask of the upper 16 bits
    static constexpr std::size_t words = 1 + R * ((C + 1) / 2);   // of a block

    // Of each block: its scale, then two columns at a time, the second one in the upper halves of the words.
    // Numbers are used as they are in the upper halves, `unit` times as large, so that each takes one
    // instruction to unpack.
    std::vector<std::int32_t> words_;
};

}  // namespace nbd
