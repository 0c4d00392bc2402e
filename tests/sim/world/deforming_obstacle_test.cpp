// Obstacles that deform by frames.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <vector>

#include "sim/fem/momentum.hpp"
#include "sim/obstacles/made_mesh.hpp"
#include "sim/world/world.hpp"
#include "tests/sim/support/momentum.hpp"
#include "tests/sim/world/box_model.hpp"
#include "tests/sim/world/same_bits.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

using Eigen::Vector3d;
using test::Model;

constexpr double g = 9.81;

/// A square sheet about the origin, of side 2.
TriMesh sheet(int cells) {
    TriMesh mesh =
        height_mesh(Eigen::MatrixXd::Zero(cells + 1, cells + 1), Eigen::Vector2d::Constant(2.0 / cells));
    mesh.X.leftCols<2>().array() -= 1;
    return mesh;
}

/// place: of a point of the sheet at a time.
Obstacle deforming(const TriMesh& mesh, const std::vector<double>& times,
                   const std::function<Vector3d(const Vector3d&, double)>& place, double friction = 0.5) {
    SurfaceFrames frames{times, {}};
    for (const double time : times) {
        Nodes& x = frames.positions.emplace_back(mesh.X);
        for (Eigen::Index i = 0; i < x.rows(); ++i) x.row(i) = place(mesh.X.row(i), time).transpose();
    }
    return {.shape = std::make_shared<const StaticSurface>(TriMesh{frames.at(0), mesh.F}),
            .friction = friction,
            .frames = std::make_shared<const SurfaceFrames>(std::move(frames))};
}

/// Frames that lift, turn and widen a sheet as a motion does.
TEST(DeformingObstacle, DoesWhatAMotionOfTheSamePlacesDoes) {
    const Model block({0.3, 0.3, 0.1}, {3, 3, 1}, {.young = 1e6, .rayleigh_mass = 0});
    const TriMesh floor = sheet(6);
    const auto lift = [](double time) { return std::clamp(time, 0.0, 0.3) * 0.5; };
    Motion motion{
        .keyframes = {{.to_next = Interpolation::linear}, {.time = 0.3, .translation = {0, 0, 0.15}}}};
    Obstacle moved{.shape = std::make_shared<const StaticSurface>(floor), .motion = motion};
    std::vector<World> worlds;
    for (const Obstacle& obstacle :
         {moved, deforming(floor, {0, 0.1, 0.3}, [&](const Vector3d&p, double time) {
              return Vector3d(p + lift(time) * Vector3d::UnitZ());
          })}) {
        World& world = worlds.emplace_back(WorldConfig{});
        world.add_obstacle(obstacle);
        world.add_body(block.at({0, 0, 0.06}));
        for (int step = 0; step < 80; ++step) ASSERT_EQ(world.step(5e-3).failure, "");
    }
    EXPECT_GT(test::centre_of_mass(worlds[0], 0).z(), 0.18);
    EXPECT_LT((worlds[0].state(0).x - worlds[1].state(0).x).cwiseAbs().maxCoeff(), 2e-5);
}

/// The middle of the sheet jumps up by several times the thickness of a block on it, in one step or a few.
TEST(DeformingObstacle, NeverPassesThroughABody) {
    const Model block({0.3, 0.3, 0.05}, {4, 4, 1}, {.young = 1e6, .rayleigh_mass = 0});
    for (const double dt : {5e-3, 2e-2, 5e-2}) {
        World world(WorldConfig{});
        world.add_obstacle(deforming(sheet(16), {0.1, 0.15}, [](const Vector3d& p, double time) {
            const double bulge = 0.2 * std::exp(-8 * p.head<2>().squaredNorm());
            return Vector3d(p + (time > 0.12 ? bulge : 0) * Vector3d::UnitZ());
        }));
        world.add_body(block.at({0, 0, 0.03}));
        double highest = 0;
        while (world.time() < 0.3) {
            ASSERT_EQ(world.step(dt).failure, "") << dt;
            ASSERT_TRUE(world.intersecting_faces().empty());
            highest = std::max(highest, test::centre_of_mass(world, 0).z());
        }
        EXPECT_GT(highest, 0.2) << dt;
    }
}

/// A belt that flows along: mu g t, until the block goes with it.
TEST(DeformingObstacle, RubsByTheSpeedOfItsSurface) {
    const Model block({0.2, 0.2, 0.06}, {2, 2, 1}, {.young = 1e6, .rayleigh_mass = 0});
    constexpr double mu = 0.3, speed = 0.8;
    for (const double dt : {2e-3, 1e-2}) {
        World world(WorldConfig{});
        world.add_obstacle(deforming(
            sheet(8), {0, 0.1, 5},
            [&](const Vector3d& p, double time) { return Vector3d(p + speed * time * Vector3d::UnitX()); },
            mu));
        world.add_body(block.at({-0.3, 0, 0.0305}));
        for (const double until : {0.1, 0.2, 0.6}) {
            while (world.time() < until - dt / 2) ASSERT_EQ(world.step(dt).failure, "");
            const double v = test::linear_momentum(world, 0).x() / world.elastic(0).mass();
            EXPECT_NEAR(v, std::min(mu * g * until, speed), 0.04 * speed) << dt << " " << until;
        }
    }
}

TEST(DeformingObstacle, StandsBeforeItsFirstFrameAndAfterItsLast) {
    const SurfaceFrames frames{
        {1, 2, 4}, {Nodes::Constant(2, 3, 0), Nodes::Constant(2, 3, 1), Nodes::Constant(2, 3, 1)}};
    EXPECT_EQ(frames.at(0), frames.positions[0]);
    EXPECT_EQ(frames.at(1.25), Nodes::Constant(2, 3, 0.25));
    EXPECT_EQ(frames.at(9), frames.positions[2]);
    EXPECT_TRUE(frames.stand(0, 1));
    EXPECT_TRUE(frames.stand(2, 9));
    EXPECT_FALSE(frames.stand(0, 1.1));
    const SurfaceFrames back{{0, 1, 2},
                             {Nodes::Constant(1, 3, 0), Nodes::Constant(1, 3, 1), Nodes::Constant(1, 3, 0)}};
    EXPECT_FALSE(back.stand(0, 2)) << "it was elsewhere between";
}

TEST(DeformingObstacle, GivesTheSameBitsOnAnyNumberOfThreadsAndFromASnapshot) {
    const Model block({0.3, 0.3, 0.1}, {3, 3, 1}, {.young = 1e6, .rayleigh_mass = 0});
    const auto made = [&] {
        World world(WorldConfig{});
        world.add_obstacle(deforming(sheet(8), {0, 0.05, 0.1, 0.3}, [](const Vector3d& p, double time) {
            return Vector3d(p.x(), p.y(), 0.1 * std::sin(9 * time) * std::cos(4 * p.x()) - 0.1 * time);
        }));
        world.add_body(block.at({0, 0, 0.06}));
        return world;
    };
    test::expect_same_bits(made, 30);
}

TEST(DeformingObstacle, RefusesFramesThatDoNotFit) {
    const TriMesh mesh = sheet(2);
    const auto error = [&](const SurfaceFrames& frames, bool is_ball = false) {
        Obstacle obstacle{.shape = std::make_shared<const StaticSurface>(mesh),
                          .frames = std::make_shared<const SurfaceFrames>(frames)};
        if (is_ball) obstacle.shape = BallShape{};
        World world(WorldConfig{});
        return test::error_of<std::invalid_argument>([&] { world.add_obstacle(obstacle); });
    };
    EXPECT_EQ(error({{}, {}}), "frames: 0 times for 0 positions of the surface");
    EXPECT_EQ(error({{0, 1}, {mesh.X}}), "frames: 2 times for 1 positions of the surface");
    EXPECT_EQ(error({{1, 0}, {mesh.X, mesh.X}}), "frames: frame 1 is at 0 s, but times must ascend");
    EXPECT_EQ(error({{0}, {mesh.X.topRows(3)}}), "frames: frame 0 needs 9 finite positions, it has 3");
    EXPECT_EQ(error({{0}, {mesh.X * NAN}}), "frames: frame 0 needs 9 finite positions, it has 9");
    EXPECT_EQ(error({{0}, {mesh.X}}, true), "obstacle: only a mesh can deform");
}

}  // namespace
}  // namespace nbd
