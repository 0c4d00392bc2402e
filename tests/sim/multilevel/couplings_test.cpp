#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <utility>
#include <vector>

#include "sim/multilevel/coupling_sum.hpp"
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

}  // namespace
}  // namespace nbd
