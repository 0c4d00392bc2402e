#include "sim/fem/modes.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <numbers>

#include "tests/support/box_mesh.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

// The box is symmetric in its three axes, so it has multiple eigenvalues.
TEST(Modes, AgreeWithADenseSolverEvenForMultipleEigenvalues) {
    for (const MassKind kind : {MassKind::lumped, MassKind::consistent}) {
        const ElasticBody body(test::box_mesh({1, 1, 1}, {3, 3, 3}), Material{}, kind);
        const Eigen::MatrixXd K = body.rest_stiffness(), M = body.mass_matrix();
        const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> dense(K, M);
        const int count = 40;
        const Modes modes = vibration_modes(body, {.count = count});
        ASSERT_EQ(modes.basis.count(), count);
        ASSERT_EQ(modes.basis.frequencies.size(), count);
        int multiple = 0;
        for (int c = 0; c < count; ++c) {
            const double expected = std::sqrt(dense.eigenvalues()[c + 6]) / (2 * std::numbers::pi);
            EXPECT_NEAR(modes.basis.frequencies[c], expected, 1e-9 * expected) << c;
            multiple += c > 0 && modes.basis.frequencies[c] < modes.basis.frequencies[c - 1] * (1 + 1e-9);
        }
        EXPECT_GT(multiple, 5);
        EXPECT_LT(modes.report.max_residual, 1e-8);
        EXPECT_LT(modes.report.orthonormality, 1e-10);
        EXPECT_LT(modes.report.rigid_residual, 1e-6);
        EXPECT_GT(modes.report.gap, 1e6);
        EXPECT_LT(modes.report.max_rigid_hz, 1e-3 * modes.basis.frequencies[0]);
    }
}

TEST(Modes, AreMassOrthonormalAscendingAndHaveAFixedSign) {
    const ElasticBody body(test::box_mesh({1, 0.6, 0.4}, {6, 4, 3}, 0.2), Material{});
    const ModeBasis basis = vibration_modes(body, {.count = 20}).basis;
    const Eigen::MatrixXd U = basis.U.cast<double>();
    const Eigen::MatrixXd gram = U.transpose() * body.mass_matrix() * U;
    EXPECT_LT((gram - Eigen::MatrixXd::Identity(20, 20)).cwiseAbs().maxCoeff(), 1e-5);
    for (int c = 0; c < 20; ++c) {
        Eigen::Index largest = 0;
        basis.U.col(c).cwiseAbs().maxCoeff(&largest);
        EXPECT_GT(basis.U(largest, c), 0);
        if (c > 0) {
            EXPECT_GE(basis.frequencies[c], basis.frequencies[c - 1]);
        }
    }
}

TEST(Modes, AreBitIdenticalForTheSameSeed) {
    const ElasticBody body(test::box_mesh({1, 0.6, 0.4}, {5, 3, 3}, 0.2), Material{});
    const ModeBasis a = vibration_modes(body, {.count = 10, .seed = 3}).basis;
    const ModeBasis b = vibration_modes(body, {.count = 10, .seed = 3}).basis;
    const ModeBasis c = vibration_modes(body, {.count = 10, .seed = 4}).basis;
    EXPECT_TRUE(a.U == b.U);
    EXPECT_EQ(a.frequencies, b.frequencies);
    EXPECT_LT((a.U - c.U).cwiseAbs().maxCoeff(), 1e-4 * a.U.cwiseAbs().maxCoeff());
}

TEST(Modes, DoNotDependOnUnitsOrPosition) {
    const double scale = 1e-3;
    TetMesh mesh = test::box_mesh({1, 0.6, 0.4}, {5, 3, 3}, 0.2);
    const ModeBasis a = vibration_modes(ElasticBody(mesh, Material{}), {.count = 8}).basis;
    mesh.X = (scale * mesh.X).rowwise() + Eigen::RowVector3d(0.1, -0.2, 0.3);
    const ModeBasis b = vibration_modes(ElasticBody(mesh, Material{}), {.count = 8}).basis;
    EXPECT_LT((b.frequencies * scale - a.frequencies).norm(), 1e-6 * a.frequencies.norm());
}

std::string failure(const ElasticBody& body, int count) {
    return test::error_of([&] { vibration_modes(body, {.count = count}); });
}

TetMesh two_boxes(bool hinged) {
    const TetMesh box = test::box_mesh({1, 1, 1}, {2, 2, 2});
    const Eigen::Index n = box.X.rows();
    TetMesh pair;
    pair.X.resize(2 * n, 3);
    pair.X << box.X, box.X.rowwise() + Eigen::RowVector3d::Constant(hinged ? 1 : 3);
    pair.T.resize(2 * box.T.rows(), 4);
    pair.T << box.T, box.T.array() + static_cast<int>(n);
    if (hinged) {  // corner (0,0,0) of the second box is corner (1,1,1) of the first
        const int kept = static_cast<int>(n) - 1, dropped = n;
        pair.T = pair.T.unaryExpr([&](int node) { return node == dropped ? kept : node - (node > dropped); })
                     .eval();
        Nodes X(2 * n - 1, 3);
        X << pair.X.topRows(n), pair.X.bottomRows(n - 1);
        pair.X = X;
    }
    return pair;
}

TEST(Modes, RejectADisconnectedBody) {
    EXPECT_EQ(failure(ElasticBody(two_boxes(false), Material{}), 20),
              "modes: found 12 rigid modes, but a free body in one piece has exactly 6; check for separate "
              "or hinged parts");
    EXPECT_EQ(failure(ElasticBody(two_boxes(true), Material{}), 20),
              "modes: found 9 rigid modes, but a free body in one piece has exactly 6; check for separate or "
              "hinged parts");
}

TEST(Modes, RejectACountAboveTheBodysModes) {
    const ElasticBody body(test::box_mesh({1, 1, 1}, {1, 1, 1}), Material{});
    EXPECT_EQ(failure(body, 0), "modes: count is 0, allowed: 1 to 17 for 8 nodes");
    EXPECT_EQ(failure(body, 18), "modes: count is 18, allowed: 1 to 17 for 8 nodes");
    EXPECT_EQ(failure(body, 17), "");
}

}  // namespace
}  // namespace nbd
