#include "sim/fem/stress.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <utility>

#include "tests/support/box_body.hpp"
#include "tests/support/box_mesh.hpp"

namespace nbd {
namespace {

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
