#include "sim/multilevel/block_sparse.hpp"

#include <gtest/gtest.h>

namespace nbd {
namespace {

/// Every second block, in a fixed irregular pattern.
template <int R, int C>
BlockSparse<R, C> some_blocks(int rows, int columns) {
    BlockSparse<R, C> A;
    A.columns = columns;
    for (int i = 0; i < rows; ++i) {
        for (int j = 0; j < columns; ++j)
            if ((3 * i + 5 * j) % 4 < 2) {
                A.column.push_back(j);
                typename BlockSparse<R, C>::Block block;
                for (int r = 0; r < R; ++r)
                    for (int c = 0; c < C; ++c) block(r, c) = std::sin(1.0 + i + 3 * j + 7 * r + 11 * c);
                A.blocks.push_back(block);
            }
        A.end_row();
    }
    return A;
}

template <int R, int C>
Eigen::MatrixXd dense(const BlockSparse<R, C>& A) {
    Eigen::MatrixXd result = Eigen::MatrixXd::Zero(R * A.rows(), C * A.columns);
    for (int i = 0; i < A.rows(); ++i) {
        const auto row = A.columns_of(i);
        for (std::size_t k = 0; k < row.size(); ++k)
            result.template block<R, C>(R * i, C * row[k]) = A.block(i, k);
    }
    return result;
}

TEST(BlockSparse, MultipliesAndTransposesAsDenseMatricesDo) {
    const auto A = some_blocks<3, 6>(700, 40);  // more rows than a task takes
    const auto B = some_blocks<6, 3>(40, 30);
    EXPECT_LT((dense(product(A, B)) - dense(A) * dense(B)).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_EQ(dense(transpose(A)), dense(A).transpose());
    const auto AB = product(A, B);
    for (int i = 0; i < AB.rows(); ++i) EXPECT_TRUE(std::ranges::is_sorted(AB.columns_of(i)));
}

template <int R, int C>
void expect_products(int rows, int columns) {
    const auto A = some_blocks<R, C>(rows, columns);
    const TransferMatrix<R, C> blocks(A);
    const Eigen::VectorXf x = Eigen::VectorXf::LinSpaced(C * columns, -1, 1);
    const Eigen::VectorXd expected = dense(A) * x.cast<double>();
    const double rounding = C * columns * dense(A).cwiseAbs().maxCoeff() / 65534;  // see ScaledBlocks
    for (int i = 0; i < rows; ++i) {
        const auto row = blocks.times(i, x.data());
        for (int r = 0; r < R; ++r) EXPECT_NEAR(row[r], expected[R * i + r], rounding);
    }
}

TEST(TransferMatrix, MultipliesAsDenseMatricesDo) {
    expect_products<3, 3>(20, 20);
    expect_products<3, 6>(20, 5);
    expect_products<6, 3>(5, 20);
    expect_products<6, 6>(7, 7);
}

}  // namespace
}  // namespace nbd
