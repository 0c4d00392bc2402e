#include "sim/fem/modes.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <utility>

#include "sim/fem/stress.hpp"
#include "tests/support/box_body.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

// The box is symmetric in its three axes, so it has multiple eigenvalues.
TEST(Modes, AgreeWithADenseSolverEvenForMultipleEigenvalues) {
    const ElasticBody body(test::box_mesh({1, 1, 1}, {3, 3, 3}), Material{});
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
    pair.T << box.T, box.T.array() + int(n);
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

class Stress : public ::testing::Test {
 protected:
    const TetMesh tets_ = test::box_mesh({1, 0.5, 0.5}, {3, 2, 2});
    Material material_{.young = 2e5, .poisson = 0.3};

    /// Stress of every tetrahedron after a deformation F and a rigid motion.
    void expect_stress(const Eigen::Matrix3d& F, double expected) const {
        const Eigen::Matrix3d R = Eigen::AngleAxisd(2.1, Eigen::Vector3d(1, -2, 0.5).normalized()).matrix();
        const Nodes x = (tets_.X * (R * F).transpose()).rowwise() + Eigen::RowVector3d(3, 2, 1);
        const Eigen::VectorXd stress = von_mises_stress(ElasticBody(tets_, material_), x);
        ASSERT_EQ(stress.size(), tets_.T.rows());
        EXPECT_LT((stress.array() - expected).abs().maxCoeff(), 1e-9 * material_.young) << expected;
    }
};

TEST_F(Stress, IsZeroUnderRigidMotionAndUniformPressure) {
    expect_stress(Eigen::Matrix3d::Identity(), 0);
    expect_stress(0.9 * Eigen::Matrix3d::Identity(), 0);
}

TEST_F(Stress, EqualsTheTensionUnderUniaxialTension) {
    const double strain = 0.05, across = -material_.poisson * strain;
    expect_stress(Eigen::Vector3d(1 + strain, 1 + across, 1 + across).asDiagonal(), material_.young * strain);
}

TEST_F(Stress, IsRootThreeTimesTheShearStressUnderPureShear) {
    Eigen::Matrix3d F = Eigen::Matrix3d::Identity();
    F(0, 1) = F(1, 0) = 0.02;
    const double mu = material_.young / (2 * (1 + material_.poisson));
    expect_stress(F, std::sqrt(3.0) * 2 * mu * 0.02);
}

// The Cauchy stress of principal axis i is s_i^2 (2 mu e_i + lambda tr e) / J with e_i = (s_i^2 - 1) / 2.
TEST_F(Stress, IsTheCauchyStressOfStVenantKirchhoff) {
    material_.law = MaterialLaw::st_venant_kirchhoff;
    const Eigen::Array3d s(1.3, 0.8, 0.8), e = (s.square() - 1) / 2;
    const double mu = material_.young / 2.6, lambda = material_.young * 0.3 / (1.3 * 0.4);
    const Eigen::Array3d cauchy = s.square() * (2 * mu * e + lambda * e.sum()) / s.prod();
    expect_stress(s.matrix().asDiagonal(), std::abs(cauchy[0] - cauchy[1]));
}

// Cauchy stresses differ by mu' (1 - 1 / (|F|^2 + 1)) (s_i^2 - s_j^2) / J with mu' = 4/3 mu.
TEST_F(Stress, IsTheCauchyStressOfStableNeoHooke) {
    material_.law = MaterialLaw::stable_neo_hookean;
    const Eigen::Array3d s(1.3, 0.8, 0.8);
    const double mu = 4.0 / 3 * material_.young / 2.6, size = s.square().sum();
    expect_stress(s.matrix().asDiagonal(),
                  mu * (1 - 1 / (size + 1)) * (s[0] * s[0] - s[1] * s[1]) / s.prod());
}

/// In a uniform state, every tetrahedron has the gradient R F and, of the law, the stress R P.
TEST_F(Stress, OfElementsIsThatOfAUniformStretch) {
    const Eigen::Array3d s(1.2, 0.9, 0.8);
    const double mu = material_.young / 2.6, lambda = material_.young * 0.3 / (1.3 * 0.4);
    const Eigen::Matrix3d R = Eigen::AngleAxisd(0.7, Eigen::Vector3d(2, 1, -1).normalized()).matrix();
    const Eigen::Array3d green = (s.square() - 1) / 2;
    const std::pair<MaterialLaw, Eigen::Array3d> laws[] = {
        {MaterialLaw::corotated, 2 * mu * (s - 1) + lambda * (s - 1).sum()},
        {MaterialLaw::st_venant_kirchhoff, s * (2 * mu * green + lambda * green.sum())}};
    for (const auto& [law, principal] : laws) {
        material_.law = law;
        const Eigen::Matrix3d F = R * s.matrix().asDiagonal(), P = R * principal.matrix().asDiagonal();
        const Nodes x = (tets_.X * F.transpose()).rowwise() + Eigen::RowVector3d(3, 2, 1);
        const ElementStress stress = element_stress(ElasticBody(tets_, material_), x);
        ASSERT_EQ(stress.P.rows(), 3 * tets_.T.rows());
        for (Eigen::Index t = 0; t < tets_.T.rows(); ++t) {
            EXPECT_LT((stress.F.middleRows<3>(3 * t).cast<double>() - F).norm(), 1e-6);
            EXPECT_LT((stress.P.middleRows<3>(3 * t).cast<double>() - P).norm(), 1e-6 * material_.young);
        }
    }
}

/// The forces of a pose are those of its stresses: -V P times the gradients of the shape functions.
TEST_F(Stress, OfElementsMakesTheElasticForces) {
    for (const MaterialLaw law : material_laws) {
        material_.law = law;
        const ElasticBody body(tets_, material_);
        Nodes x = tets_.X;
        for (Eigen::Index i = 0; i < x.rows(); ++i)
            x.row(i) += 0.1 * Eigen::RowVector3d(std::sin(9. * static_cast<double>(i)), x(i, 0), -x(i, 2));
        ElementPose pose;
        ElementForces of_elements;
        body.pose(x, pose, of_elements);
        const ElementStress stress = element_stress(body, x);
        double largest = 0;
        for (int t = 0; t < body.element_count(); ++t) {
            Eigen::Matrix3d D;
            for (int k = 0; k < 3; ++k)
                D.col(k) = (tets_.X.row(tets_.T(t, k + 1)) - tets_.X.row(tets_.T(t, 0))).transpose();
            const Eigen::Matrix3d P = stress.P.middleRows<3>(3 * t).cast<double>(),
                                  forces = -body.rest_volumes()[t] * P * D.inverse().transpose();
            const Eigen::Matrix3d& expected = of_elements[t];
            EXPECT_LT((forces - expected).norm(), 1e-5 * expected.norm()) << t;
            EXPECT_LT((stress.F.middleRows<3>(3 * t).cast<double>() - body.deformation_gradient(x, t)).norm(),
                      1e-5);
            largest = std::max(largest, expected.norm());
        }
        EXPECT_GT(largest, 10);
    }
}

}  // namespace
}  // namespace nbd
