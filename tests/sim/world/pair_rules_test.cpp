#include "sim/contact/pair_rules.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "meshing/surface/mesh.hpp"
#include "sim/obstacles/static_surface.hpp"
#include "sim/world/start_check.hpp"
#include "sim/world/world.hpp"
#include "tests/sim/support/momentum.hpp"
#include "tests/sim/world/box_model.hpp"
#include "tests/support/box_body.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

using test::floor_at;
using test::Model;

constexpr double g = 9.81;

void step_all(World& world, int steps, double dt) {
    for (int i = 0; i < steps; ++i) {
        const WorldReport report = world.step(dt);
        ASSERT_EQ(report.failure, "") << i;
    }
}

/// Where free bodies fall to from z0 in this time, to the error of the rule that steps follow.
void expect_free_fall(const World& world, int body, double z0, double time, double dt) {
    EXPECT_NEAR(test::centre_of_mass(world, body)[2], z0 - g / 2 * time * time, 2 * g * dt * dt) << body;
}

TEST(PairRules, BodiesThatDoNotMeetPassThroughEachOther) {
    for (const double size : {0.2, 0.5})
        for (const double dt : {2e-3, 5e-3}) {
            const Model box({size, size, size}, {2, 2, 2}, {.rayleigh_mass = 0}),
                other({size, size, size}, {1, 2, 3}, {.rayleigh_mass = 0});
            World world({});
            world.add_body(box.at({0, 0, 0}));
            world.add_body(other.at({0.1 * size, 0, 0.3 * size}));  // overlaps the first
            EXPECT_FALSE(world.intersecting_faces().empty());
            EXPECT_NE(judge_start(world, {"a", "b"}).refusal, "");
            world.set_pair(1, 0, {.meets = false});
            EXPECT_TRUE(world.intersecting_faces().empty());
            EXPECT_TRUE(world.resolve_start().empty());
            const StartVerdict verdict = judge_start(world, {"a", "b"});
            EXPECT_EQ(verdict.refusal, "");
            EXPECT_TRUE(verdict.faults.empty());
            const int steps = static_cast<int>(std::lround(0.1 / dt));
            for (int i = 0; i < steps; ++i) EXPECT_EQ(world.step(dt).contacts, 0);
            expect_free_fall(world, 0, 0, steps * dt, dt);
            expect_free_fall(world, 1, 0.3 * size, steps * dt, dt);
        }
}

/// The third meets the others still.
TEST(PairRules, HoldForTheNamedPairAlone) {
    const Model box({0.2, 0.2, 0.2}, {2, 2, 2}, {.rayleigh_mass = 0});
    World world({});
    world.add_obstacle(floor_at(0));
    for (const double z : {0.1005, 0.15, 0.36}) world.add_body(box.at({0, 0, z}));
    world.set_pair(0, 1, {.meets = false});
    step_all(world, 60, 5e-3);
    EXPECT_GT(world.surface(1).col(2).minCoeff(), 0);  // meets the floor
    EXPECT_LT(world.surface(1).col(2).minCoeff(), 0.01);
    EXPECT_GT(world.surface(2).col(2).minCoeff(), 0.15);  // and the third lies on it, or on the first
    for (const Intersection& i : world.intersecting_faces()) ADD_FAILURE() << i.surface_a << i.surface_b;
}

TEST(PairRules, OfABodyAndAnObstacleOfEachKind) {
    const TriMesh block{test::box_body({1, 1, 0.2}, {1, 1, 1}).surface};
    const std::vector<Obstacle> kinds{
        floor_at(0),
        {.shape = BallShape{.centre = {0, 0, -0.5}, .radius = 0.5}},
        {.shape = std::make_shared<const StaticSurface>(block)},
    };
    for (const Obstacle& obstacle : kinds) {
        const Model box({0.2, 0.2, 0.2}, {2, 2, 2}, {.rayleigh_mass = 0});
        World world({});
        world.add_obstacle({.shape = PlaneShape{.point = {0, 0, -5}}});  // so that numbers differ
        world.add_obstacle(obstacle);
        world.add_body(box.at({0.05, 0, 0.05}));  // in the obstacle
        world.add_body(box.at({-0.25, 0, 0.3}));
        EXPECT_NE(judge_start(world, {"a", "b"}).faults.size(), 0u);
        world.set_pair(0, party_of_obstacle(1), {.meets = false});
        EXPECT_EQ(judge_start(world, {"a", "b"}).faults.size(), 0u);
        EXPECT_TRUE(world.resolve_start().empty());
        step_all(world, 60, 5e-3);
        expect_free_fall(world, 0, 0.05, 0.3, 5e-3);
        EXPECT_GT(test::centre_of_mass(world, 1)[2], 0.05 - g / 2 * 0.09 + 0.1);  // it was met
    }
}

/// Arms that clap.
TEST(PairRules, OfABodyAndItself) {
    constexpr double height = 0.1;
    for (const int levels : {0, 2}) {  // a surface that hangs on tetrahedra has other searches
        Body body = test::fine_box_body({2, 0.1, height}, {40, 2, 2}, levels);
        body.tets.X.rowwise() -= body.tets.X.colwise().mean().eval();
        body.tets.X = test::hairpin(body.tets.X, height, 0.04);
        WorldBody arms{
            .elastic = std::make_shared<const ElasticBody>(body), .W = body.W, .F = body.surface.F};
        arms.state = {body.tets.X, Nodes::Zero(body.tets.X.rows(), 3)};
        for (Eigen::Index i = 0; i < body.tets.X.rows(); ++i)
            if (body.tets.X(i, 0) < -0.3) arms.state.v(i, 2) = body.tets.X(i, 2) < 0 ? 1 : -1;
        World world({.gravity = Eigen::Vector3d::Zero()});
        world.add_body(std::move(arms));
        world.set_pair(0, 0, {.meets = false});
        for (int i = 0; i < 30; ++i) {
            const WorldReport report = world.step(2e-3);
            ASSERT_EQ(report.failure, "") << i;
            EXPECT_EQ(report.contacts, 0);
        }
        EXPECT_TRUE(world.intersecting_faces().empty());
        world.set_pair(0, 0, {});
        EXPECT_FALSE(world.intersecting_faces().empty());  // it has passed through itself
        EXPECT_NE(test::refusal([&] { world.step(2e-3); }), "");
    }
}

TEST(PairRules, GiveAPairItsFriction) {
    const Model box({0.2, 0.2, 0.1}, {2, 2, 1}, {.young = 1e6, .rayleigh_mass = 0});
    for (const double mu : {0.0, 0.1, 0.3})
        for (const double dt : {2e-3, 5e-3}) {
            World world({});
            world.add_obstacle(floor_at(0, 0.8));
            world.add_body(box.at({0, 0, 0.0502}, Eigen::Matrix3d::Identity(), {2, 0, 0}));
            world.add_body(box.at({0, 1, 0.0502}, Eigen::Matrix3d::Identity(), {2, 0, 0}));
            world.set_pair(party_of_obstacle(0), 0, {.friction = mu});
            const int steps = static_cast<int>(std::lround(0.3 / dt));
            step_all(world, steps, dt);
            const double way = 2 * 0.3 - mu * g / 2 * 0.09;
            EXPECT_NEAR(test::centre_of_mass(world, 0)[0], way, 0.01 * way) << mu << ' ' << dt;
            EXPECT_LT(test::centre_of_mass(world, 1)[0], 0.3);  // 0.255 by the floor's own friction
        }
}

TEST(PairRules, OfTwoBodiesHaveTheirFriction) {
    const Model block({0.2, 0.2, 0.1}, {2, 2, 1}, {.young = 1e6, .rayleigh_mass = 0}),
        table({1.2, 1, 0.1}, {3, 3, 1}, {.young = 1e6, .rayleigh_mass = 0});
    World world({});
    WorldBody below = table.at({0.3, 0, -0.0501});
    Grip all;
    for (int i = 0; i < below.state.x.rows(); ++i) all.nodes.push_back(i);
    below.grips = {all};
    world.add_body(std::move(below));
    for (const double y : {-0.3, 0.0, 0.3})
        world.add_body(block.at({0, y, 0.0508}, Eigen::Matrix3d::Identity(), {1.5, 0, 0}));
    world.set_pair(0, 1, {.friction = 0});
    world.set_pair(2, 0, {.friction = 0.2});
    step_all(world, 60, 5e-3);
    const auto way = [&](int body) { return test::centre_of_mass(world, body)[0]; };
    EXPECT_NEAR(way(1), 1.5 * 0.3, 0.01);
    EXPECT_NEAR(way(2), 1.5 * 0.3 - 0.2 * g / 2 * 0.09, 0.01);
    EXPECT_NEAR(way(3), 1.5 * 0.3 - 0.5 * g / 2 * 0.09, 0.01);  // the usual
}

TEST(PairRules, RefuseWhatIsNotThere) {
    const Model box({0.2, 0.2, 0.2}, {1, 1, 1});
    World world({});
    world.add_body(box.at({0, 0, 1}));
    world.add_obstacle(floor_at(0));
    EXPECT_EQ(test::refusal([&] { world.set_pair(0, 1, {}); }),
              "world: a pair names body 1, but there are 1");
    EXPECT_EQ(test::refusal([&] { world.set_pair(party_of_obstacle(2), 0, {}); }),
              "world: a pair names obstacle 2, but there are 1");
    EXPECT_EQ(test::refusal([&] { world.set_pair(-1, -1, {}); }),
              "pair: two obstacles never meet; name a body");
    EXPECT_EQ(test::refusal([&] { world.set_pair(0, -1, {.friction = -0.5}); }),
              "pair: friction is -0.5, allowed: finite and >= 0");
}

}  // namespace
}  // namespace nbd
