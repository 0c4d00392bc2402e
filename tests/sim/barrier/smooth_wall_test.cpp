#include "sim/barrier/smooth_wall.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <random>

namespace nbd {
namespace {

using Eigen::Vector3d;

/// Walls, steps and ways of points, drawn at random.
class SmoothWalls {
 public:
    Vector3d vector(double size) { return size * Vector3d(number(), number(), number()); }
    double number() { return std::uniform_real_distribution<double>(-1, 1)(random_); }

    SmoothWall wall(bool is_ball, double angle) {
        Obstacle obstacle{.shape = PlaneShape{.point = vector(1), .normal = vector(1).normalized()}};
        if (is_ball) obstacle.shape = BallShape{.centre = vector(1), .radius = 0.3 + 0.1 * number()};
        const Vector3d centre = vector(1);
        const auto place = [&](double size) {
            return Motion{.centre = centre,
                          .keyframes = {{.translation = vector(size),
                                         .rotation = angle * vector(1),
                                         .scale = 1 + 0.5 * size * number()}}}
                .at(0);
        };
        SmoothWall wall(obstacle);
        wall.begin_step(place(0.2), place(0.2));
        return wall;
    }

 private:
    std::mt19937 random_{7};
};

TEST(SmoothWall, LetsPointsGoAsFarAsTheyAreApart) {
    SmoothWalls draw;
    constexpr double tolerance = 1e-4;
    int stopped = 0, free = 0;
    for (int i = 0; i < 4000; ++i) {
        const bool is_ball = i % 2 == 0;
        const SmoothWall wall = draw.wall(is_ball, i % 3 == 0 ? 0 : i % 3 == 1 ? 0.05 : 1);
        const double progress = i % 5 == 0 ? 0 : 0.5 * (draw.number() + 1), least = 0.01;
        const Vector3d from = draw.vector(2), to = from + draw.vector(i % 7 == 0 ? 0.05 : 1);
        if (!(wall.distance(from, progress).distance > 2 * least)) continue;
        const auto distance = [&](double share) {
            return wall.distance(from + share * (to - from), progress + share * (1 - progress)).distance;
        };
        const double limit = wall.limit(from, to, progress, least, tolerance);
        ASSERT_GE(limit, 0);
        ASSERT_LE(limit, 1);
        const double way = wall.relative_way(from, to, progress);
        for (int k = 0; k <= 200; ++k) {
            const double share = k / 200.0;
            ASSERT_TRUE(share > limit || distance(share) > least - 1e-9) << i << ' ' << share;
            ASSERT_LE(std::abs(distance(share) - distance(0)), way + 1e-12) << i;
        }
        if (limit < 1) {
            ASSERT_LT(distance(limit), least + tolerance + 1e-9) << i << " stops too early";
            ++stopped;
        } else {
            ++free;
        }
    }
    EXPECT_GT(stopped, 100);
    EXPECT_GT(free, 500);
}

TEST(SmoothWall, ThatSpinsAboutItsNormalStopsNothing) {
    const Motion spin{.keyframes = {{.to_next = Interpolation::linear}, {.time = 1, .rotation = {0, 0, 1}}}};
    SmoothWall plane({.shape = PlaneShape{}});
    plane.begin_step(spin.at(0), spin.at(1));
    EXPECT_EQ(plane.limit({3, 0, 0.01}, {1, 2, 0.01}, 0, 0.009, 1e-6), 1);
    const Vector3d way = plane.way_of({2, 0, 0.01}, 0);
    EXPECT_LT((way - Vector3d(2 * std::cos(1.0) - 2, 2 * std::sin(1.0), 0)).norm(), 1e-14);
}

TEST(SmoothWall, MovesItsPointsAsItIsPlaced) {
    SmoothWalls draw;
    for (int i = 0; i < 100; ++i) {
        const SmoothWall wall = draw.wall(false, 0.3);
        const Vector3d p = draw.vector(1);
        // Points of the surface stay on it.
        const auto foot = [&](const Vector3d& at, double progress) {
            const SurfaceDistance found = wall.distance(at, progress);
            return Vector3d(at - found.distance * found.normal);
        };
        const Vector3d start = foot(p, 0), end = start + wall.way_of(p, 0);
        EXPECT_LT(std::abs(wall.distance(end, 1).distance), 1e-12);
    }
}

}  // namespace
}  // namespace nbd
