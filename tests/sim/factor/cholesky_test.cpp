#include "sim/factor/cholesky.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <numeric>

#include "sim/factor/blas.hpp"
#include "sim/factor/lane_blocks.hpp"
#include "sim/factor/sweep_matrix.hpp"
#include "sim/fem/elastic_body.hpp"
#include "tests/sim/support/matrices.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

class CholeskyOfABar : public ::testing::Test {
 protected:
    CholeskyOfABar() : body(test::box_mesh({1, 1, 1}, {5, 4, 3}, 0.2), Material{}) {
        body.pose(body.rest().X, pose, forces);
        A = matrix(1e-4);
        b = Eigen::VectorXd::LinSpaced(body.unknown_count(), -1, 2);
    }
    SparseMatrix matrix(double stiffness) const { return test::combined(body, 1, stiffness, pose); }
    ElasticBody body;
    ElementPose pose;
    ElementForces forces;
    SparseMatrix A;
    Eigen::VectorXd b;
};

std::string failure(Cholesky& cholesky, const SparseMatrix& A) {
    return test::error_of([&] { cholesky.factorize(A); });
}

TEST_F(CholeskyOfABar, SolvesForDifferentValuesOfOnePattern) {
    Cholesky cholesky;
    cholesky.analyze(A);
    for (const double stiffness : {1e-4, 1e-2, 1.0}) {
        A = matrix(stiffness);
        cholesky.factorize(A);
        Eigen::VectorXd x(b.size());
        cholesky.solve(b, x);
        EXPECT_LT((A * x - b).norm(), 1e-12 * A.norm() * x.norm());
        Eigen::VectorXd in_place = b;
        cholesky.solve(in_place, in_place);
        EXPECT_EQ(in_place, x);
    }
}

TEST_F(CholeskyOfABar, ReportsAnIndefiniteMatrixAndRecovers) {
    Cholesky cholesky;
    cholesky.analyze(A);
    SparseMatrix bad = A;
    bad.coeffRef(3 * 17 + 1, 3 * 17 + 1) = -5;
    const std::string text = failure(cholesky, bad);
    EXPECT_EQ(text.substr(0, 61), "factorize: the matrix is not positive definite (pivot of node");
    EXPECT_FALSE(cholesky.factorized());
    EXPECT_THROW(cholesky.solve(b, b), std::logic_error);
    bad.coeffRef(4, 4) = std::nan("");
    EXPECT_EQ(failure(cholesky, bad), "factorize: the matrix holds a NaN or an infinity");
    EXPECT_EQ(failure(cholesky, A), "");
}

TEST_F(CholeskyOfABar, RejectsAnotherPattern) {
    Cholesky cholesky;
    EXPECT_EQ(failure(cholesky, A).substr(0, 24), "factorize: matrix has 36");
    cholesky.analyze(A);
    const ElasticBody other(test::box_mesh({1, 1, 1}, {2, 2, 2}), Material{});
    EXPECT_EQ(failure(cholesky, other.pattern().zero_matrix()).substr(0, 24), "factorize: matrix has 81");
}

TEST(Blas, WarnsInOneLineUnlessAFastLibraryIsLoaded) {
    const BlasInfo info = blas_info();
    EXPECT_FALSE(info.name.empty());
    EXPECT_EQ(info.fast, info.warning.empty());
    EXPECT_EQ(info.warning.find('\n'), std::string::npos);
}

const RowLists pattern = ElasticBody(test::box_mesh({3, 1, 1}, {12, 4, 4}), Material{}).pattern().lists();

/// The turn of each row in a sweep.
std::vector<int> turns(const SweepOrder& order) {
    std::vector<int> turn(order.rows(), -1);
    int next = 0;
    for (const auto& colour : order.colours)
        for (const RowRange& part : colour)
            for (int i = part.begin; i < part.end; ++i) turn[i] = next++;
    return turn;
}

TEST(SweepOrder, HasEveryRowOnce) {
    const SweepOrder order(pattern, 16);
    std::vector<int> turn = turns(order);
    std::ranges::sort(turn);
    std::vector<int> all(pattern.rows());
    std::iota(all.begin(), all.end(), 0);
    EXPECT_EQ(turn, all);
}

TEST(SweepOrder, PartsOfAColourAreNotCoupled) {
    const SweepOrder order(pattern, 16);
    ASSERT_GT(order.colours.size(), 1U);
    ASSERT_TRUE(std::ranges::any_of(order.colours, [](const auto& parts) { return parts.size() > 1; }));
    for (const auto& colour : order.colours)
        for (const RowRange& part : colour)
            for (int i = part.begin; i < part.end; ++i)
                for (const int j : pattern.columns_of(i))
                    for (const RowRange& other : colour)
                        EXPECT_FALSE(other.begin != part.begin && j >= other.begin && j < other.end);
}

TEST(SweepOrder, SplitsTheColumnsOfARowByTheirTurn) {
    const SweepOrder order(pattern, 16);
    const std::vector<int> turn = turns(order);
    EXPECT_EQ(order.column.size(), pattern.column.size() - static_cast<std::size_t>(pattern.rows()));
    for (int row = 0; row < pattern.rows(); ++row) {
        const std::size_t i = row;
        const auto turn_at = [&](int k) { return turn[order.column[k]]; };
        for (int k = order.earlier[i] + 1; k < order.earlier[i + 1]; ++k)
            EXPECT_LT(turn_at(k - 1), turn_at(k));
        for (int k = order.later[i] + 1; k < order.later[i + 1]; ++k) EXPECT_GT(turn_at(k - 1), turn_at(k));
        const auto ascending = pattern.columns_of(row);
        for (std::size_t k = 0; k < ascending.size(); ++k) {
            const int place = order.place[static_cast<std::size_t>(order.offset[i]) + k];
            if (ascending[k] == row) {
                EXPECT_EQ(place, -1);
                continue;
            }
            ASSERT_GE(place, 0);
            EXPECT_EQ(order.column[place], ascending[k]);
            const auto& half = turn[ascending[k]] < turn[i] ? order.earlier : order.later;
            EXPECT_TRUE(half[i] <= place && place < half[i + 1]);
        }
    }
}

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
    const RowLists lists{{0, 2, 5, 7}, {0, 1, 0, 1, 2, 1, 2}};
    const auto order = std::make_shared<const SweepOrder>(lists, 2);
    SweepMatrix<ScaledBlocks<6, 6>> A(order);
    Eigen::MatrixXd lower = Eigen::MatrixXd::Zero(18, 18), upper = lower;
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < std::ssize(lists.columns_of(i)); ++k) {
            const int j = lists.columns_of(i)[k];
            if (j == i) continue;
            const Eigen::Matrix<double, 6, 6> given =
                some_block<6, 6>(2) + 0.1 * (i + j) * some_block<6, 6>(2);
            A.set(i, k, j < i ? Eigen::Matrix<double, 6, 6>(given.transpose()) : given);
            (j < i ? lower : upper).block<6, 6>(6 * i, 6 * j) = A.block(i, k).cast<double>();
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
