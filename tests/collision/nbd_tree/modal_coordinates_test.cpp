#include "collision/nbd_tree/modal_coordinates.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "tests/collision/models.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

Vertices random_points(std::mt19937& random, int count) {
    Vertices X(count, 3);
    for (int i = 0; i < count; ++i) X.row(i) = shapes::uniform3(random);
    return X;
}

double weighted_error(const Vertices& X, const Vertices& x, const Eigen::VectorXf& w,
                      const RigidTransform& m) {
    double sum = 0;
    for (Eigen::Index i = 0; i < X.rows(); ++i)
        sum += w[i] * (m.R * X.row(i).transpose() + m.t - x.row(i).transpose()).cast<double>().squaredNorm();
    return sum;
}

void expect_rotation(const Eigen::Matrix3f& R) {
    EXPECT_NEAR((R.transpose() * R - Eigen::Matrix3f::Identity()).norm(), 0, 1e-5) << R;
    EXPECT_NEAR(R.determinant(), 1, 1e-5) << R;
}

TEST(MatchShape, RecoversARigidMotion) {
    std::mt19937 random(1);
    for (int i = 0; i < 50; ++i) {
        const Vertices X = random_points(random, 3 + i);
        const Eigen::VectorXf w = random_points(random, 3 + i).col(0).array() + 1.5f;
        const RigidTransform motion = shapes::random_motion(random, 3);
        const RigidTransform found = match_shape(X, shapes::moved(X, motion), w);
        EXPECT_NEAR((found.R - motion.R).norm(), 0, 2e-5);
        EXPECT_NEAR((found.t - motion.t).norm(), 0, 2e-5);
    }
}

TEST(MatchShape, FitsBetterThanNearbyMotions) {
    std::mt19937 random(2);
    for (int i = 0; i < 20; ++i) {
        const Vertices X = random_points(random, 30), x = X + 0.5f * random_points(random, 30);
        const Eigen::VectorXf w = 3 * random_points(random, 30).col(0).array() + 3.1f;
        const RigidTransform found = match_shape(X, x, w);
        expect_rotation(found.R);
        const double error = weighted_error(X, x, w, found);
        for (int k = 0; k < 20; ++k) {
            const Eigen::Vector3f axis = shapes::uniform3(random).normalized();
            const RigidTransform other{Eigen::AngleAxisf(0.02f, axis) * found.R,
                                       found.t + 0.01f * shapes::uniform3(random)};
            EXPECT_GT(weighted_error(X, x, w, other), error);
        }
    }
}

TEST(MatchShape, StaysAccurateFarFromTheOrigin) {
    std::mt19937 random(3);
    const Vertices X = random_points(random, 100);
    RigidTransform motion = shapes::random_motion(random, 1);
    motion.t += Eigen::Vector3f(1e4f, -2e4f, 5e3f);
    const RigidTransform found = match_shape(X, shapes::moved(X, motion), Eigen::VectorXf::Ones(100));
    EXPECT_NEAR((found.R - motion.R).norm(), 0, 3e-3);  // coordinates of 2e4 are 2e-3 apart in float32
    EXPECT_NEAR((found.t - motion.t).norm(), 0, 4e-3);
}

TEST(MatchShape, IsAProperRotationForDegenerateSets) {
    std::mt19937 random(4);
    const Eigen::VectorXf w = Eigen::VectorXf::Ones(20);
    for (int i = 0; i < 20; ++i) {
        const Vertices X = random_points(random, 20);
        Vertices flat = X, straight = X, reflected = X;
        flat.col(2).setZero();
        straight.rightCols<2>().setZero();
        reflected.col(1) *= -1;
        const Vertices point = Eigen::RowVector3f(1, 2, 3).replicate(20, 1);
        const RigidTransform motion = shapes::random_motion(random, 1);
        for (const Vertices& from : {X, flat, straight, reflected, point})
            for (const Vertices& to : {X, flat, straight, reflected, point}) {
                const RigidTransform found = match_shape(from, shapes::moved(to, motion), w);
                expect_rotation(found.R);
                EXPECT_TRUE(found.t.allFinite());
            }
        for (const Vertices& set : {flat, straight, point}) {
            const Vertices x = shapes::moved(set, motion);
            EXPECT_NEAR((shapes::moved(set, match_shape(set, x, w)) - x).norm(), 0, 2e-4);
            EXPECT_NEAR((match_shape(set, set, w).R - Eigen::Matrix3f::Identity()).norm(), 0, 1e-5);
        }
    }
}

/// A pose without a number in it must not look like one with the identity as its rotation.
TEST(MatchShape, HasNoRotationOnlyWithoutNumbers) {
    std::mt19937 random(6);
    const Vertices X = random_points(random, 20);
    const Eigen::VectorXf w = Eigen::VectorXf::Ones(20);
    for (const float bad :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
        Vertices x = X;
        x(7, 1) = bad;
        const RigidTransform found = match_shape(X, x, w);
        EXPECT_TRUE(found.R.array().isNaN().all()) << found.R;
        EXPECT_TRUE(found.t.array().isNaN().all()) << found.t;
    }
    for (const float size : {1e-38f, 1e-20f, 1e18f, 1e38f}) {
        const RigidTransform found = match_shape(X, size * X, w);
        expect_rotation(found.R);
        EXPECT_NEAR((found.R - Eigen::Matrix3f::Identity()).norm(), 0, 1e-4) << size;
    }
}

TEST(ModalCoordinates, AreTheWeightedProjectionOfTheDeformationAlone) {
    std::mt19937 random(5);
    const auto s = shapes::torus(20, 12);
    const shapes::Modes modes = shapes::make_modes(s, 10, 60, 6);
    const Eigen::MatrixXd U = modes.clustered.U.numbers().cast<double>();
    Eigen::VectorXd w(U.rows());
    for (Eigen::Index i = 0; i < modes.clustered.w.size(); ++i)
        w.segment<3>(3 * i).setConstant(modes.clustered.w[i]);
    ModalCoordinatesScratch scratch;
    Eigen::VectorXf z(10);
    for (int i = 0; i < 10; ++i) {
        const Eigen::VectorXf q =
            Eigen::VectorXf::NullaryExpr(10, [&](Eigen::Index) { return 0.2f * shapes::uniform(random); });
        const RigidTransform motion = shapes::random_motion(random, 2);
        const Vertices x = shapes::moved(shapes::nbd_pose(s, modes.U, q), motion);
        const RigidTransform align = modal_coordinates(modes.clustered, x, scratch, z);
        EXPECT_NEAR((align.R - motion.R).norm(), 0, 1e-5);
        EXPECT_NEAR((align.t - motion.t).norm(), 0, 1e-5);
        const Eigen::VectorXd expected = U.transpose() * (w.asDiagonal() * (U * q.cast<double>()));
        ASSERT_GT(expected.norm(), 1);
        EXPECT_NEAR((z.cast<double>() - expected).norm() / expected.norm(), 0, 1e-4);
    }
}

TEST(CheckClusteredModes, ReportsEachKindOfInvalidModes) {
    const auto s = shapes::sphere(6, 8);
    const ClusteredModes whole = shapes::make_modes(s, 4, 10, 7).clustered;
    const int n = s.X.rows();
    check_clustered_modes(whole, n);
    const auto error = [&](auto tamper) {
        ClusteredModes modes = whole;
        tamper(modes);
        return test::refusal([&] { check_clustered_modes(modes, n); });
    };
    using M = ClusteredModes;
    EXPECT_EQ(error([](M& m) { m.representatives.clear(); }), "modes: no representative vertices");
    EXPECT_EQ(error([](M& m) { m.representatives[2] = 50; }),
              "modes: representative vertex 50, but the surface has 50 vertices");
    EXPECT_EQ(error([](M& m) { m.representatives[2] = -1; }),
              "modes: representative vertex -1, but the surface has 50 vertices");
    EXPECT_EQ(error([](M& m) { m.w.conservativeResize(9); }),
              "modes: 10 representatives, but 9 weights, 10 rest positions and 30 rows of U instead of 30");
    EXPECT_EQ(error([](M& m) { m.X.conservativeResize(11, 3); }),
              "modes: 10 representatives, but 10 weights, 11 rest positions and 30 rows of U instead of 30");
    EXPECT_EQ(error([](M& m) { m.U = FixedMatrix(m.U.numbers().topRows(29)); }),
              "modes: 10 representatives, but 10 weights, 10 rest positions and 29 rows of U instead of 30");
    EXPECT_EQ(error([](M& m) { m.U = FixedMatrix(Eigen::MatrixXf(30, 0)); }), "modes: U has no columns");
    EXPECT_EQ(error([](M& m) {
                  Eigen::MatrixXf U = m.U.numbers();
                  U(3, 2) = NAN;
                  m.U = FixedMatrix(U);
              }),
              "modes: a rest position or an entry of U is not finite");
    EXPECT_EQ(error([](M& m) { m.X(3, 2) = INFINITY; }),
              "modes: a rest position or an entry of U is not finite");
    EXPECT_EQ(error([](M& m) { m.w[4] = 0; }), "modes: weight 4 is 0, allowed: finite and above 0");
    EXPECT_EQ(error([](M& m) { m.w[4] = NAN; }), "modes: weight 4 is nan, allowed: finite and above 0");
}

}  // namespace
}  // namespace nbd
