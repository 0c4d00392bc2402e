#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <set>
#include <utility>
#include <vector>

#include "sim/multilevel/aggregates.hpp"
#include "sim/multilevel/block_sparse.hpp"
#include "sim/multilevel/coupling_sum.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/on_threads.hpp"

namespace nbd {
namespace {

/// Couplings of several nodes each, in two bodies of 60 nodes.
struct Couplings {
    std::vector<int> first_unknown{0, 180, 360};
    std::vector<CouplingTerm> terms;
    std::vector<Coupling> couplings;

    Couplings() {
        for (int c = 0; c < 80; ++c) {
            const int begin = terms.size();
            for (int k = 0; k < 5; ++k) {
                const int node = (7 * c + 11 * k) % 60, body = k < 2 ? 0 : 1;
                terms.push_back({body, node, 180 * body + 3 * node, std::cos(c + 3 * k), node % 13 == 5});
            }
            const Eigen::Vector3d n = Eigen::Vector3d(std::sin(c), std::cos(c), 0.3).normalized();
            couplings.push_back(
                {begin, begin + 5, 100 * n * n.transpose() + 0.1 * Eigen::Matrix3d::Identity()});
        }
    }
    CoupledSystem system() const { return {{}, first_unknown, terms, couplings}; }

    Eigen::MatrixXd dense() const {
        const CoupledSystem whole = system();
        Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(360, 360);
        for (const Coupling& coupling : couplings) {
            Eigen::MatrixXd J = Eigen::MatrixXd::Zero(3, 360);
            for (const CouplingTerm& t : whole.terms_of(coupling))
                if (!t.held) J.middleCols<3>(t.unknown) += t.weight * Eigen::Matrix3d::Identity();
            sum += J.transpose() * coupling.A * J;
        }
        return sum;
    }
};

template <int B>
Eigen::MatrixXd dense_couplings(const CouplingMatrix<B>& C, int level_rows) {
    Eigen::MatrixXd result = Eigen::MatrixXd::Zero(B * level_rows, B * level_rows);
    for (int i = 0; i < C.blocks.rows(); ++i) {
        const auto columns = C.blocks.columns_of(i);
        for (std::size_t k = 0; k < columns.size(); ++k)
            result.template block<B, B>(B * C.rows[i], B * C.rows[columns[k]]) = C.blocks.block(i, k);
    }
    return result;
}

/// The least eigenvalue of D less its share of C, over the largest of C.
template <int B>
double least_damping(const CouplingMatrix<B>& C) {
    const Eigen::MatrixXd sum = dense_couplings(C, C.rows.back() + 1);
    Eigen::MatrixXd rest = -CouplingMatrix<B>::damping_share * sum;
    for (std::size_t i = 0; i < C.rows.size(); ++i) {
        const Eigen::Index at = B * C.rows[i];
        rest.template block<B, B>(at, at) += C.damping[i];
    }
    for (Eigen::Index i = 0; i < rest.rows(); ++i)
        if (sum(i, i) == 0) rest(i, i) = 1;  // not a row of C
    using Solver = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>;
    return Solver(rest, Eigen::EigenvaluesOnly).eigenvalues().minCoeff() /
           Solver(sum, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff();
}

/// Every row of C comes from three rows of the coarser level.
BlockSparse<3, 6> some_prolongation(const CouplingMatrix<3>& C) {
    BlockSparse<3, 6> P;
    P.columns = 11;
    for (const int row : C.rows) {
        for (const int column : {row % 4, 4 + row % 3, 7 + row % 4}) {
            P.column.push_back(column);
            P.blocks.push_back(Eigen::Matrix<double, 3, 6>::NullaryExpr([&](Eigen::Index r, Eigen::Index c) {
                return std::sin(row + 5.0 * column + 2.0 * r + 7.0 * c);
            }));
        }
        P.end_row();
    }
    return P;
}

TEST(CouplingSum, AddsUpTheCouplingsThatAct) {
    Couplings scene;
    CouplingSum sum;
    sum.begin(scene.system());
    EXPECT_TRUE(sum.matrix().empty());
    const std::vector<Coupling> all = scene.couplings;
    // Some act, others do, then all, then fewer again.
    for (const int step : {2, 3, 1, 4}) {
        const int before = sum.pattern();
        for (std::size_t c = 0; c < all.size(); ++c)
            scene.couplings[c].A =
                c % static_cast<std::size_t>(step) == 0 ? all[c].A : Eigen::Matrix3d::Zero();
        sum.update(scene.system());
        EXPECT_LT((dense_couplings(sum.matrix(), 120) - scene.dense()).cwiseAbs().maxCoeff(), 1e-10);
        EXPECT_EQ(sum.pattern() == before, step == 4) << "places of couplings that let go are kept";
        for (int node = 0; node < 120; ++node)
            if (const int row = sum.row_of(node); row >= 0) {
                EXPECT_EQ(sum.matrix().rows[row], node);
            }
    }
}

TEST(CouplingMatrix, BecomesThatOfTheCoarserUnknowns) {
    const Couplings scene;
    CouplingSum sum;
    sum.begin(scene.system());
    sum.update(scene.system());
    const CouplingMatrix<3>& C = sum.matrix();
    const BlockSparse<3, 6> P = some_prolongation(C);
    std::vector<int> rows(11);
    for (int i = 0; i < 11; ++i) rows[i] = 3 * i;
    const CouplingMatrix<6> coarser = coarsen(C, P, rows);
    EXPECT_EQ(coarser.rows, rows);
    Eigen::MatrixXd prolongation = Eigen::MatrixXd::Zero(360, 6 * 36);
    for (int i = 0; i < P.rows(); ++i)
        for (std::size_t k = 0; k < 3; ++k)
            prolongation.block<3, 6>(3 * C.rows[i], 18 * P.columns_of(i)[k]) = P.block(i, k);
    const Eigen::MatrixXd expected = prolongation.transpose() * scene.dense() * prolongation;
    EXPECT_LT((dense_couplings(coarser, 36) - expected).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(CouplingMatrix, HasEnoughDampingForSweeps) {
    const Couplings scene;
    CouplingSum sum;
    sum.begin(scene.system());
    sum.update(scene.system());
    EXPECT_GT(least_damping(sum.matrix()), -1e-12);
    std::vector<int> rows(11);
    for (int i = 0; i < 11; ++i) rows[i] = i;
    EXPECT_GT(least_damping(coarsen(sum.matrix(), some_prolongation(sum.matrix()), rows)), -1e-12);
}

/// A coupling of one node is part of its diagonal block and needs no more.
TEST(CouplingSum, DampsACouplingOfOneNodeByItself) {
    const std::vector<int> first_unknown{0, 9};
    const std::vector<CouplingTerm> terms{{0, 1, 3, -0.5, false}};
    const std::vector<Coupling> couplings{{0, 1, Eigen::Vector3d(1, 2, 3).asDiagonal().toDenseMatrix()}};
    const CoupledSystem system{{}, first_unknown, terms, couplings};
    CouplingSum sum;
    sum.begin(system);
    sum.update(system);
    ASSERT_EQ(sum.matrix().rows, std::vector<int>{1});
    EXPECT_EQ(sum.matrix().damping[0], sum.matrix().blocks.block(0, 0));
}

TEST(CouplingSum, GivesTheSameBitsOnAnyNumberOfThreads) {
    const Couplings scene;
    CouplingSum one, four;
    for (const auto& [threads, sum] : {std::pair(1, &one), std::pair(4, &four)})
        test::on_threads(threads, [&, sum = sum] {
            sum->begin(scene.system());
            sum->update(scene.system());
        });
    EXPECT_EQ(one.matrix().blocks.column, four.matrix().blocks.column);
    EXPECT_EQ(one.matrix().blocks.blocks, four.matrix().blocks.blocks);
    EXPECT_EQ(one.matrix().damping, four.matrix().damping);
}

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
