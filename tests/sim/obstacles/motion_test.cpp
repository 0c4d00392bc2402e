#include "sim/obstacles/motion.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "sim/obstacles/obstacle.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

using Eigen::Vector3d;
constexpr double pi = std::numbers::pi;

/// Two places, two seconds apart.
Motion two_places(Interpolation way) {
    return {.keyframes = {{.time = 1, .translation = {1, 0, 0}, .to_next = way},
                          {.time = 3, .translation = {5, 2, 0}, .scale = 3}}};
}

TEST(Motion, StandsBeforeTheFirstAndAfterTheLastKeyframe) {
    for (const Interpolation way : {Interpolation::hold, Interpolation::linear, Interpolation::smooth}) {
        const Motion motion = two_places(way);
        EXPECT_EQ(motion.at(-7)(Vector3d(1, 1, 1)), Vector3d(2, 1, 1));
        EXPECT_EQ(motion.at(1)(Vector3d(1, 1, 1)), Vector3d(2, 1, 1));
        EXPECT_EQ(motion.at(3)(Vector3d(1, 1, 1)), Vector3d(8, 5, 3));
        EXPECT_EQ(motion.at(1e6)(Vector3d(1, 1, 1)), Vector3d(8, 5, 3));
        EXPECT_FALSE(motion.stands());
        EXPECT_TRUE(motion.rests(-1, 1));
        EXPECT_TRUE(motion.rests(3, 4));
    }
    EXPECT_TRUE(Motion{}.stays());
    const Motion elsewhere{.keyframes = {{.translation = {1, 0, 0}}}};
    EXPECT_TRUE(elsewhere.stands());
    EXPECT_FALSE(elsewhere.stays());
}

TEST(Motion, GoesFromKeyframeToKeyframeAsTold) {
    for (const double u : {0.1, 0.25, 0.5, 0.9}) {
        const double time = 1 + 2 * u;
        const Keyframe even = two_places(Interpolation::linear).keyframe_at(time),
                       eased = two_places(Interpolation::smooth).keyframe_at(time),
                       held = two_places(Interpolation::hold).keyframe_at(time);
        EXPECT_LT((even.translation - Vector3d(1 + 4 * u, 2 * u, 0)).norm(), 1e-14);
        EXPECT_NEAR(even.scale, 1 + 2 * u, 1e-14);
        const double share = 3 * u * u - 2 * u * u * u;
        EXPECT_LT((eased.translation - Vector3d(1 + 4 * share, 2 * share, 0)).norm(), 1e-14);
        EXPECT_EQ(held.translation, Vector3d(1, 0, 0));
    }
    // Sums of steps come to 3 s only up to rounding.
    EXPECT_EQ(two_places(Interpolation::hold).at(3 - 1e-12)(Vector3d::Zero()), Vector3d(5, 2, 0));
    EXPECT_TRUE(two_places(Interpolation::hold).rests(2.9, 3.1)) << "it jumps";
    EXPECT_FALSE(two_places(Interpolation::linear).rests(2.9, 3.1));
}

TEST(Motion, TurnsByNumbersAboutOneAxis) {
    const Vector3d axis = Vector3d(1, 2, -2) / 3, centre(3, 1, 2), p(0.2, -0.4, 1);
    const Motion motion{.centre = centre,
                        .keyframes = {{.rotation = -2 * pi * axis, .to_next = Interpolation::linear},
                                      {.time = 10, .rotation = 6 * pi * axis}}};
    for (const double time : {0.3, 1.0, 2.5, 4.9, 8.8}) {
        const Eigen::AngleAxisd turn(-2 * pi + 8 * pi * time / 10, axis);
        EXPECT_LT((motion.at(time)(p) - centre - turn * (p - centre)).norm(), 1e-13) << time;
        EXPECT_LT((motion.at(time).inverse(motion.at(time)(p)) - p).norm(), 1e-13);
    }
}

TEST(Motion, TurnsTheShortestWayBetweenDifferentAxes) {
    const Vector3d first = pi / 2 * Vector3d::UnitX(), second = pi / 2 * Vector3d::UnitY();
    const Motion motion{.keyframes = {{.rotation = first, .to_next = Interpolation::linear},
                                      {.time = 1, .rotation = second}}};
    const auto turn = [](const Vector3d& v) {
        return Eigen::AngleAxisd(v.norm(), v.normalized()).toRotationMatrix();
    };
    const Eigen::AngleAxisd whole(turn(first).transpose() * turn(second));
    ASSERT_NEAR(whole.angle(), 2 * pi / 3, 1e-12);
    const Eigen::Matrix3d half =
        turn(first) * Eigen::AngleAxisd(whole.angle() / 2, whole.axis()).toRotationMatrix();
    EXPECT_LT((motion.at(0.5).turn - half).norm(), 1e-12);
    EXPECT_LT((motion.at(1).turn - turn(second)).norm(), 1e-12);
}

TEST(Motion, TravelsWithTheSameBitsAsAVelocity) {
    const Motion motion = travel({0.3, -1.7, 0.1}, 0.2);
    for (const double time : {0.1, 0.2, 0.7, 13.31, 1e5})
        EXPECT_EQ(motion.at(time).translation, std::max(time - 0.2, 0.0) * Vector3d(0.3, -1.7, 0.1));
    EXPECT_TRUE(travel({0, 0, 0}).stays());
    EXPECT_EQ(travel({1, 0, 0}, 1, 3).at(7).translation, Vector3d(2, 0, 0));
}

TEST(Motion, IsEasedAsOneMove) {
    const Motion motion = eased({.translation = {0, 0, 2}, .start = 1, .duration = 4});
    EXPECT_NEAR(motion.at(2).translation.z(), 2 * (3.0 / 16 - 2.0 / 64), 1e-15);
    EXPECT_TRUE(eased({.start = 3, .duration = 1}).stays());
    const Motion jump = eased({.translation = {0, 0, 2}, .start = 1});
    EXPECT_EQ(jump.at(0.99).translation.z(), 0);
    EXPECT_EQ(jump.at(1).translation.z(), 2);
    EXPECT_TRUE(jump.rests(0.9, 1.1));
}

TEST(Motion, GoesOnFromWhereItIs) {
    Motion motion = travel({1, 0, 0});
    motion.go_to({.translation = {0, 1, 0}, .rotation = {0, 0, 350 * pi / 180}}, 2, 2.5);
    EXPECT_EQ(motion.at(1).translation, Vector3d(1, 0, 0));
    EXPECT_EQ(motion.at(2).translation, Vector3d(2, 0, 0));
    EXPECT_LT((motion.at(2.25).translation - Vector3d(1, 0.5, 0)).norm(), 1e-14);
    EXPECT_NEAR(motion.keyframe_at(2.25).rotation.z(), -5 * pi / 180, 1e-12) << "the shortest way";
    EXPECT_EQ(motion.at(9).translation, Vector3d(0, 1, 0));
    motion.go_to({.translation = {0, 3, 0}}, 2.5, 3);
    EXPECT_EQ(motion.at(2.5).translation, Vector3d(0, 1, 0));
    EXPECT_EQ(motion.at(3).translation, Vector3d(0, 3, 0));
    motion.go_to({.translation = {4, 0, 0}}, 2, 3);  // as after a step that is taken anew
    EXPECT_EQ(motion.at(2.5).translation, Vector3d(3, 0, 0));
}

TEST(Motion, IsRefusedWhereItCannotBe) {
    const auto refused = [](const Motion& motion) { return test::refusal([&] { check_motion(motion); }); };
    EXPECT_EQ(refused(two_places(Interpolation::hold)), "");
    EXPECT_EQ(refused({.keyframes = {{.time = 1}, {.time = 1}}}),
              "keyframe 1 of its motion is at 1 s, but must be after 1 s, the time of the one before it");
    EXPECT_EQ(refused({.keyframes = {{.scale = 0}}}),
              "keyframe 0 of its motion is not finite, or its scale is not positive");
    EXPECT_EQ(refused({.centre = {NAN, 0, 0}}), "the centre of its motion is not finite");
    EXPECT_EQ(refused({.keyframes = {{.translation = {0, INFINITY, 0}}}}),
              "keyframe 0 of its motion is not finite, or its scale is not positive");
}

TEST(Obstacle, IsAsFarAwayAsItIsMoved) {
    const Motion motion{.centre = {1, 0, 0},
                        .keyframes = {{.translation = {0, 0, 1}, .rotation = {0, pi / 2, 0}, .scale = 2}}};
    // The ball goes from (2, 0, 0) by way of (1, 0, -2) to (1, 0, -1), and the plane z = 0 to x = 1.
    const Obstacle ball{.shape = BallShape{.centre = {2, 0, 0}, .radius = 0.25}, .motion = motion},
        plane{.shape = PlaneShape{}, .motion = motion};
    const auto of_ball = signed_distance(ball, {1, 3, -1}, 0, 1e9);
    EXPECT_NEAR(of_ball->distance, 2.5, 1e-14);
    EXPECT_LT((of_ball->normal - Vector3d::UnitY()).norm(), 1e-14);
    const auto of_plane = signed_distance(plane, {1.75, 4, 5}, 0, 1e9);
    EXPECT_NEAR(of_plane->distance, 0.75, 1e-14);
    EXPECT_LT((of_plane->normal - Vector3d::UnitX()).norm(), 1e-14);
}

}  // namespace
}  // namespace nbd
