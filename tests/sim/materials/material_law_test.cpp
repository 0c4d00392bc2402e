#include "sim/materials/material_law.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "sim/materials/element_tangent.hpp"
#include "sim/materials/polar.hpp"

namespace nbd {
namespace {

using Matrix9 = Eigen::Matrix<double, 9, 9>;
using Vector9 = Eigen::Matrix<double, 9, 1>;

/// Deformation gradients: nearly at rest, stretched, crushed, flat, inverted, with two equal stretches.
std::array<Eigen::Matrix3d, lanes> gradients() {
    const auto turned = [](double a, double b, double c) -> Eigen::Matrix3d {
        const Eigen::Matrix3d R = Eigen::AngleAxisd(1.2, Eigen::Vector3d(1, 2, 3).normalized()).matrix(),
                              Q = Eigen::AngleAxisd(0.7, Eigen::Vector3d(-1, 0, 2).normalized()).matrix();
        return R * Eigen::Vector3d(a, b, c).asDiagonal() * Q.transpose();
    };
    return {turned(1.001, 0.999, 1.002), turned(2, 1.5, 1.2), turned(0.3, 0.5, 0.4), turned(1.1, 0.9, 0.02),
            turned(1.2, 0.8, -0.4),      turned(1.3, 1.3, 1), turned(0.9, 0.9, 0.9), turned(3, 0.6, 0.5)};
}

class EveryLaw : public ::testing::TestWithParam<MaterialLaw> {
 protected:
    static LaneModuli moduli() {
        LaneModuli m;
        m.law.fill(GetParam());
        m.mu.setConstant(3);
        m.lambda.setConstant(5);
        return m;
    }

    static PrincipalStretches stretches(const std::array<Eigen::Matrix3d, lanes>& all) {
        LaneMatrix3 F, R;
        for (int l = 0; l < lanes; ++l) F.set_lane(l, all[l]);
        rotations_of(F, R);
        return principal_stretches(F, R);
    }

    static Lanes energies(const std::array<Eigen::Matrix3d, lanes>& F) {
        return respond(moduli(), stretches(F).sigma).energy;
    }

    static std::array<Eigen::Matrix3d, lanes> stresses(const std::array<Eigen::Matrix3d, lanes>& F) {
        const PrincipalStretches s = stretches(F);
        const PrincipalResponse r = respond(moduli(), s.sigma);
        std::array<Eigen::Matrix3d, lanes> P;
        for (int l = 0; l < lanes; ++l)
            P[l] = s.U.lane(l) *
                   Eigen::Vector3d(r.stress[0][l], r.stress[1][l], r.stress[2][l]).asDiagonal() *
                   s.V.lane(l).transpose();
        return P;
    }

    /// dP/dF of every lane, from a tangent.
    static std::array<Matrix9, lanes> matrices(const ElementTangent& tangent) {
        std::array<Matrix9, lanes> result;
        for (int k = 0; k < 9; ++k) {
            LaneMatrix3 H;
            for (int e = 0; e < 9; ++e) H.entries[e].setConstant(e == k);
            const LaneMatrix3 P = tangent.multiply(H);
            for (int l = 0; l < lanes; ++l)
                for (int e = 0; e < 9; ++e) result[l](e, k) = P.entries[e][l];
        }
        return result;
    }

    /// Entry k of all matrices, by columns, moved by h.
    static std::array<Eigen::Matrix3d, lanes> moved(std::array<Eigen::Matrix3d, lanes> F, int k, double h) {
        for (Eigen::Matrix3d& one : F) one(k % 3, k / 3) += h;
        return F;
    }
};

TEST_P(EveryLaw, StretchesRebuildTheGradient) {
    const auto F = gradients();
    const auto [U, V, sigma] = stretches(F);
    for (int l = 0; l < lanes; ++l) {
        const Eigen::Matrix3d rebuilt = U.lane(l) *
                                        Eigen::Vector3d(sigma[0][l], sigma[1][l], sigma[2][l]).asDiagonal() *
                                        V.lane(l).transpose();
        EXPECT_LT((rebuilt - F[l]).norm(), 1e-13);
        for (const Eigen::Matrix3d& Q : {U.lane(l), V.lane(l)}) {
            EXPECT_LT((Q * Q.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-13);
            EXPECT_GT(Q.determinant(), 0);
        }
    }
}

TEST_P(EveryLaw, StressIsTheDerivativeOfTheEnergy) {
    const auto F = gradients();
    const auto P = stresses(F);
    constexpr double h = 1e-5;
    for (int k = 0; k < 9; ++k) {
        const Lanes slope = (energies(moved(F, k, h)) - energies(moved(F, k, -h))) / (2 * h);
        for (int l = 0; l < lanes; ++l) EXPECT_NEAR(P[l](k % 3, k / 3), slope[l], 1e-7) << l << ' ' << k;
    }
}

TEST_P(EveryLaw, TangentIsTheDerivativeOfTheStress) {
    const auto F = gradients();
    const PrincipalStretches s = stretches(F);
    const auto K = matrices(ElementTangent(s, respond(moduli(), s.sigma), Lanes::Ones()));
    constexpr double h = 1e-5;
    for (int k = 0; k < 9; ++k) {
        const auto before = stresses(moved(F, k, -h)), after = stresses(moved(F, k, h));
        for (std::size_t l = 0; l < lanes; ++l) {
            const Eigen::Matrix3d slope = (after[l] - before[l]) / (2 * h);
            EXPECT_LT((Eigen::Map<const Vector9>(slope.data()) - K[l].col(k)).norm(), 1e-6 * K[l].norm())
                << l << ' ' << k;
        }
    }
}

TEST_P(EveryLaw, ProjectionMakesNegativeEigenvaluesZero) {
    const PrincipalStretches s = stretches(gradients());
    PrincipalResponse response = respond(moduli(), s.sigma);
    const auto exact = matrices(ElementTangent(s, response, Lanes::Ones()));
    response.project();
    const auto projected = matrices(ElementTangent(s, response, Lanes::Ones()));
    bool changed = false;
    for (std::size_t l = 0; l < lanes; ++l) {
        const Eigen::SelfAdjointEigenSolver<Matrix9> eigen(exact[l]);
        const Matrix9 expected = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).asDiagonal() *
                                 eigen.eigenvectors().transpose();
        EXPECT_LT((projected[l] - expected).norm(), 1e-10 * exact[l].norm()) << l;
        changed = changed || eigen.eigenvalues().minCoeff() < -0.1;
    }
    EXPECT_TRUE(changed);
}

TEST_P(EveryLaw, IsLinearElasticityForSmallStrains) {
    constexpr double h = 1e-5;
    Eigen::Matrix3d strain;
    strain << 1, 0.3, -0.2, 0.3, -0.5, 0.4, -0.2, 0.4, 0.7;
    std::array<Eigen::Matrix3d, lanes> F;
    F.fill(Eigen::Matrix3d::Identity() + h * strain);
    const Eigen::Matrix3d expected = 2 * 3 * strain + 5 * strain.trace() * Eigen::Matrix3d::Identity();
    EXPECT_LT((stresses(F)[0] / h - expected).norm(), 1e-3);
    EXPECT_NEAR(energies(F)[0] / (h * h), 3 * strain.squaredNorm() + 2.5 * strain.trace() * strain.trace(),
                1e-3);
}

INSTANTIATE_TEST_SUITE_P(Laws, EveryLaw, ::testing::ValuesIn(material_laws),
                         [](const auto& test) { return std::string(name(test.param)); });

TEST(MaterialLaw, NamesAreReadBack) {
    for (const MaterialLaw law : material_laws) EXPECT_EQ(material_law(name(law)), law);
    EXPECT_FALSE(material_law("jelly"));
}

Eigen::Matrix3d some_rotation(int k) {
    const Eigen::Vector3d axis(std::sin(k), std::cos(3 * k), std::sin(2 * k + 1));
    return Eigen::AngleAxisd(0.37 * k, axis.normalized()).toRotationMatrix();
}

void expect_polar_factor(const Eigen::Matrix3d& F, const Eigen::Matrix3d& R) {
    EXPECT_LT((R.transpose() * R - Eigen::Matrix3d::Identity()).norm(), 1e-13);
    EXPECT_GT(R.determinant(), 0);
    const Eigen::Matrix3d S = R.transpose() * F;
    EXPECT_LE((S - S.transpose()).cwiseAbs().maxCoeff(), 1e-12 * F.cwiseAbs().maxCoeff());
}

TEST(Polar, RecoversTheRotationOfAStretchedFrame) {
    for (int k = 0; k < 200; ++k) {
        const Eigen::Matrix3d R = some_rotation(k), Q = some_rotation(k + 77);
        const Eigen::Vector3d stretch(1 + 0.9 * std::sin(k), 1 + 0.5 * std::cos(k), 1.5 + std::sin(5 * k));
        const Eigen::Matrix3d F = R * Q * stretch.asDiagonal() * Q.transpose();
        expect_polar_factor(F, rotation_of(F));
        EXPECT_LT((rotation_of(F) - R).norm(), 1e-12) << "stretch " << stretch.transpose();
    }
}

TEST(Polar, LanesAreIndependent) {
    LaneMatrix3 F, R;
    const double broken = std::numeric_limits<double>::quiet_NaN();
    for (int l = 0; l < lanes; ++l) {
        const Eigen::Vector3d stretch(1.2, 0.8, l % 3 == 0 ? -0.4 : 1.0);
        F.set_lane(l, some_rotation(l) * stretch.asDiagonal());
    }
    F.set_lane(3, Eigen::Matrix3d::Constant(broken));
    F.set_lane(5, Eigen::Matrix3d::Zero());
    rotations_of(F, R);
    for (int l = 0; l < lanes; ++l)
        EXPECT_LT((R.lane(l) - rotation_of(F.lane(l))).norm(), 1e-13) << "lane " << l;
}

TEST(Polar, MirrorsTheLeastStretchedDirectionOfAnInvertedFrame) {
    for (int k = 0; k < 200; ++k) {
        const Eigen::Matrix3d R = some_rotation(k), Q = some_rotation(k + 31);
        const Eigen::Matrix3d F = R * Q * Eigen::Vector3d(1.7, 0.9, -0.3).asDiagonal() * Q.transpose();
        ASSERT_LT(F.determinant(), 0);
        expect_polar_factor(F, rotation_of(F));
        EXPECT_LT((rotation_of(F) - R).norm(), 1e-12);
    }
}

TEST(Polar, IsContinuousThroughAFlatFrame) {
    const Eigen::Matrix3d R = some_rotation(5), Q = some_rotation(9);
    for (double thickness = 0.2; thickness > -0.2; thickness -= 0.01) {
        const Eigen::Matrix3d F = R * Q * Eigen::Vector3d(1.2, 0.8, thickness).asDiagonal() * Q.transpose();
        EXPECT_LT((rotation_of(F) - R).norm(), 1e-11) << thickness;
    }
}

TEST(Polar, GivesAProperRotationForDegenerateFrames) {
    for (const Eigen::Matrix3d& F :
         {Eigen::Matrix3d(Eigen::Matrix3d::Zero()), Eigen::Matrix3d(-Eigen::Matrix3d::Identity()),
          Eigen::Matrix3d(Eigen::Vector3d(1, 0, 0).asDiagonal()),
          Eigen::Matrix3d(1e-200 * Eigen::Matrix3d::Identity()), Eigen::Matrix3d(1e100 * some_rotation(3))}) {
        expect_polar_factor(F, rotation_of(F));
    }
    Eigen::Matrix3d broken = Eigen::Matrix3d::Identity();
    broken(1, 2) = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(rotation_of(broken), Eigen::Matrix3d::Identity());
}

}  // namespace
}  // namespace nbd
