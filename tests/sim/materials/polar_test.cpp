#include "sim/materials/polar.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

namespace nbd {
namespace {

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
