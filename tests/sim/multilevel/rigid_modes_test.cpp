#include <gtest/gtest.h>

#include <set>

#include "sim/multilevel/aggregates.hpp"
#include "tests/support/box_mesh.hpp"

namespace nbd {
namespace {

/// A grid of rows whose neighbours are those beside them, and a row apart from it.
std::vector<std::vector<int>> grid(int side) {
    std::vector<std::vector<int>> rows;
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x) {
            std::vector<int> row;
            for (int dy = -1; dy <= 1; ++dy)
                for (int dx = -1; dx <= 1; ++dx)
                    if (x + dx >= 0 && x + dx < side && y + dy >= 0 && y + dy < side)
                        row.push_back((y + dy) * side + x + dx);
            rows.push_back(row);
        }
    rows.push_back({side * side});
    return rows;
}

TEST(Aggregates, CoverAllRowsThatHaveNeighbours) {
    const auto rows = grid(20);
    const Aggregates aggregates = aggregate(rows);
    EXPECT_EQ(aggregates.of.back(), -1);
    std::vector<int> sizes(aggregates.count, 0);
    for (std::size_t i = 0; i + 1 < rows.size(); ++i) {
        ASSERT_GE(aggregates.of[i], 0);
        ++sizes[aggregates.of[i]];
    }
    for (const int size : sizes) EXPECT_GE(size, 4);
    EXPECT_GT(aggregates.count, 20);
    EXPECT_LT(aggregates.count, 70);
}

TEST(Tentative, HoldsEveryRigidMotionInOrthonormalColumns) {
    const TetMesh mesh = test::box_mesh({2, 0.4, 0.4}, {12, 3, 3});
    std::vector<std::vector<int>> rows(mesh.X.rows());
    for (Eigen::Index t = 0; t < mesh.T.rows(); ++t)
        for (int a = 0; a < 4; ++a)
            for (int b = 0; b < 4; ++b) rows[mesh.T(t, a)].push_back(mesh.T(t, b));
    for (auto& row : rows) {
        const std::set<int> different(row.begin(), row.end());
        row.assign(different.begin(), different.end());
    }
    const Aggregates aggregates = aggregate(rows);
    const RigidModes<3> modes = rigid_modes(mesh.X);
    const Tentative<3> coarse = tentative(aggregates, modes);
    ASSERT_GT(aggregates.count, 5);
    std::vector<Eigen::Matrix<double, 6, 6>> gram(aggregates.count, Eigen::Matrix<double, 6, 6>::Zero());
    for (std::size_t i = 0; i < modes.size(); ++i) {
        const std::size_t a = aggregates.of[i];
        const auto& P = coarse.P.block(i, 0);
        EXPECT_LT((P * coarse.modes[a] - modes[i]).norm(), 1e-12);
        gram[a] += P.transpose() * P;
    }
    for (const auto& G : gram) EXPECT_LT((G - Eigen::Matrix<double, 6, 6>::Identity()).norm(), 1e-12);
}

TEST(Tentative, GivesAZeroColumnToAMotionThatMovesNothing) {
    Nodes X(2, 3);
    X << 0, 0, 0, 1, 0, 0;  // turning about the x axis moves neither
    const Tentative<3> coarse = tentative(Aggregates{.of = {0, 0}, .count = 1}, rigid_modes(X));
    const Eigen::Matrix<double, 6, 6> gram = coarse.P.block(0, 0).transpose() * coarse.P.block(0, 0) +
                                             coarse.P.block(1, 0).transpose() * coarse.P.block(1, 0);
    int zeros = 0;
    for (int c = 0; c < 6; ++c) {
        zeros += gram(c, c) == 0;
        if (gram(c, c) != 0) {
            EXPECT_NEAR(gram(c, c), 1, 1e-12);
        }
    }
    EXPECT_EQ(zeros, 1);
}

}  // namespace
}  // namespace nbd
