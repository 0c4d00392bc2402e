#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "sim/factor/lane_blocks.hpp"
#include "sim/factor/sweep_matrix.hpp"

namespace nbd {
namespace {

/// Irregular blocks, each of another size of numbers.
template <int R, int C>
Eigen::Matrix<double, R, C> some_block(int k) {
    Eigen::Matrix<double, R, C> block;
    for (int i = 0; i < R * C; ++i)
        block.data()[i] = std::pow(10.0, 5 * k - 10) * std::sin(1 + 7 * i + 3 * k);
    return block;
}

constexpr int count = 5;

/// The largest error of an entry over the largest entry of its block.
template <class Blocks>
double error_of(const Blocks& blocks) {
    double most = 0;
    for (int k = 0; k < count; ++k) {
        const auto given = some_block<Blocks::rows, Blocks::columns>(k);
        const Eigen::MatrixXd difference = blocks.block(k).template cast<double>() - given;
        most = std::max(most, difference.cwiseAbs().maxCoeff() / given.cwiseAbs().maxCoeff());
    }
    return most;
}

template <class Blocks>
void expect_products() {
    constexpr int R = Blocks::rows, C = Blocks::columns;
    Blocks blocks(count);
    for (int k = 0; k < count; ++k) blocks.set(k, some_block<R, C>(k));
    EXPECT_LE(error_of(blocks), 1.01 / 65534);
    const Eigen::VectorXf x = Eigen::VectorXf::LinSpaced(C * 9, -1, 1);
    const std::array<int, 3> at{7, 0, 3};
    for (int first : {0, 2}) {
        Eigen::Matrix<double, R, 1> expected = Eigen::Matrix<double, R, 1>::Zero();
        for (int k = 0; k < 3; ++k)
            expected += blocks.block(first + k).template cast<double>() *
                        x.segment<C>(C * at[k]).template cast<double>();
        const auto row = blocks.row_product(first, at, x.data());
        for (int r = 0; r < R; ++r) EXPECT_NEAR(row[r], expected[r], 1e-5 * expected.norm());
    }
    const auto none = blocks.row_product(1, {}, x.data());
    for (int r = 0; r < R; ++r) EXPECT_EQ(none[r], 0);
}

TEST(FloatBlocks, KeepTheirNumbersAndMultiply) {
    expect_products<FloatBlocks<3, 3>>();
    expect_products<FloatBlocks<6, 6>>();
}

TEST(ScaledBlocks, KeepTheirNumbersAndMultiply) {
    expect_products<ScaledBlocks<3, 6>>();
    expect_products<ScaledBlocks<6, 3>>();
    expect_products<ScaledBlocks<6, 6>>();
}

TEST(ScaledBlocks, RoundABlockAndItsTransposeAlike) {
    ScaledBlocks<3, 6> blocks(1);
    ScaledBlocks<6, 3> transposed(1);
    blocks.set(0, some_block<3, 6>(1));
    transposed.set(0, some_block<3, 6>(1).transpose());
    EXPECT_EQ(blocks.block(0), transposed.block(0).transpose());
}

TEST(ScaledBlocks, BecomeNaNIfANumberIsNotFinite) {
    for (const double wrong : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
        Eigen::Matrix<double, 6, 3> block = some_block<6, 3>(2);
        block(4, 1) = wrong;
        ScaledBlocks<6, 3> blocks(1);
        blocks.set(0, block);
        EXPECT_TRUE(blocks.block(0).array().isNaN().all());
    }
}

/// Rows of a symmetric matrix of 16-bit blocks, before and after the diagonal, against the dense one.
TEST(SweepMatrix, MultipliesRowsOfScaledBlocks) {
    const std::array<int, 4> offset{0, 2, 5, 7};
    const std::array<int, 7> column{0, 1, 0, 1, 2, 1, 2};
    const auto order = std::make_shared<const SweepOrder>(offset, column, 2);
    SweepMatrix<ScaledBlocks<6, 6>> A(order);
    Eigen::MatrixXd lower = Eigen::MatrixXd::Zero(18, 18), upper = lower;
    for (int i = 0; i < 3; ++i)
        for (int k = offset[i]; k < offset[static_cast<std::size_t>(i) + 1]; ++k) {
            const int j = column[k];
            if (j == i) continue;
            const Eigen::Matrix<double, 6, 6> given =
                some_block<6, 6>(2) + 0.1 * (i + j) * some_block<6, 6>(2);
            const std::size_t place = k - offset[i];
            A.set(i, place, j < i ? Eigen::Matrix<double, 6, 6>(given.transpose()) : given);
            (j < i ? lower : upper).block<6, 6>(6 * i, 6 * j) = A.block(i, place).cast<double>();
        }
    EXPECT_EQ((lower - upper.transpose()).norm(), 0);
    const Eigen::VectorXf x = Eigen::VectorXf::LinSpaced(18, -1, 2);
    const auto expect_row = [&](const LaneVector<6>& row, const Eigen::MatrixXd& matrix, int i) {
        const Eigen::VectorXd expected = matrix.middleRows(6 * i, 6) * x.cast<double>();
        for (int r = 0; r < 6; ++r) EXPECT_NEAR(row[r], expected[r], 1e-5 * matrix.norm());
    };
    for (int i = 0; i < 3; ++i) {
        expect_row(A.times_earlier(i, x.data()), lower, i);
        expect_row(A.times_later(i, x.data()), upper, i);
    }
}

TEST(ScaledBlocks, HoldZerosAndNumbersNearTheEndsOfTheRange) {
    ScaledBlocks<6, 6> blocks(3);
    blocks.set(0, Eigen::Matrix<double, 6, 6>::Zero());
    blocks.set(1, Eigen::Matrix<double, 6, 6>::Constant(-3e38));
    blocks.set(2, Eigen::Matrix<double, 6, 6>::Constant(1e-44));
    EXPECT_TRUE(blocks.block(0).isZero(0));
    EXPECT_TRUE(blocks.block(1).isConstant(-3e38F, 1e-6F));
    EXPECT_TRUE(blocks.block(2).allFinite());
}

}  // namespace
}  // namespace nbd
