#include "sim/world/world.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <memory>
#include <utility>

#include "collision/base/stopwatch.hpp"
#include "tests/sim/support/momentum.hpp"
#include "tests/sim/world/box_model.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

using test::floor_at;
using test::linear_momentum;
using test::Model;
using test::turned;

class DroppedBody : public ::testing::TestWithParam<std::tuple<double, double>> {};

TEST_P(DroppedBody, StaysOnTheBodyBelow) {
    const auto [height, young] = GetParam();
    const Model box({1, 0.4, 0.3}, {6, 3, 2}, {.young = young});
    World world(WorldConfig{});
    world.add_obstacle(floor_at(0));
    world.add_body(box.at({0, 0, 0.16}));
    world.add_body(box.at({0.05, 0.03, 0.16 + 0.35 + height}, turned(0.4)));
    int pressing = 0;
    double energy = 1e300;
    for (int i = 0; i < 160; ++i) {
        const WorldReport report = world.step(5e-3);
        ASSERT_EQ(report.failure, "");
        EXPECT_TRUE(report.solver_converged);
        if (report.face_pairs > 0) ++pressing;
        const double now = report.kinetic_energy + report.elastic_energy + report.gravity_energy;
        EXPECT_LT(now, energy * 1.02 + 1);  // the contact layers store a little energy that is not counted
        energy = std::min(energy, now);
    }
    EXPECT_GT(pressing, 10);
    EXPECT_TRUE(world.intersecting_faces().empty());
    EXPECT_GT(world.state(1).x.col(2).mean(), world.state(0).x.col(2).mean());
}

INSTANTIATE_TEST_SUITE_P(HeightsAndStiffness, DroppedBody,
                         ::testing::Combine(::testing::Values(0.3, 1.0), ::testing::Values(5e4, 2e5)));

TEST(World, SaysWhereTheTimeOfItsStepsWent) {
    World world(WorldConfig{.gravity = Eigen::Vector3d::Zero()});
    test::add_colliding_boxes(world);
    const Stopwatch watch;
    double sum_us = 0;
    for (int i = 0; i < 30; ++i) {
        const WorldReport report = world.step(5e-3);
        for (const double part : {report.update_us, report.collision_us, report.detect_us, report.assemble_us,
                                  report.solve_us, report.rest_us}) {
            EXPECT_TRUE(part > 0 || i < 29);
            sum_us += part;
        }
    }
    EXPECT_LE(sum_us, watch.microseconds());
}

/// A block that is lifted from the floor it rests on: its contacts press where the solution of the step
/// begins, and would pull where it ends.
TEST(World, ContactsLetGoOfABodyThatIsLifted) {
    const Model box({0.4, 0.4, 0.2}, {2, 2, 1}, {.young = 1e6});
    const double g = 9.81, dt = 5e-3;
    World world(WorldConfig{});
    world.add_obstacle(floor_at(0));
    world.add_body(box.at({0, 0, 0.104}));
    for (int i = 0; i < 100; ++i) ASSERT_EQ(world.step(dt).failure, "");
    const Eigen::VectorXd& masses = world.elastic(0).node_masses();
    const double weight = g * masses.sum();
    ASSERT_NEAR(world.contact_forces(0).col(2).sum(), weight, 0.01 * weight);
    world.forces(0).col(2) = 4 * g * masses;
    ASSERT_EQ(world.step(dt).failure, "");
    EXPECT_GT(world.contact_forces(0).col(2).minCoeff(), -1e-6 * weight);
    EXPECT_GT(world.state(0).v.col(2).dot(masses) / masses.sum(), 0.98 * 3 * g * dt);
}

TEST(World, GripsMoveTheirNodesAndReleaseThem) {
    const Model box({1, 0.2, 0.2}, {6, 2, 2});
    WorldBody entry = box.at({0, 0, 0});
    const auto end = [&](double x) {
        return test::nodes_where(box.body.tets.X,
                                 [&](const Eigen::Vector3d& p) { return std::abs(p.x() - x) < 1e-9; });
    };
    const double turn = 0.6;
    entry.grips = {{.nodes = end(-0.5)},
                   {.nodes = end(0.5),
                    .motion = eased({.translation = {0.1, 0, 0}, .rotation = {turn, 0, 0}, .duration = 0.2}),
                    .release = 0.4}};
    World world(WorldConfig{.gravity = Eigen::Vector3d::Zero()});
    world.add_body(entry);
    for (int i = 0; i < 60; ++i) ASSERT_EQ(world.step(5e-3).failure, "");
    const Eigen::AngleAxisd R(turn, Eigen::Vector3d::UnitX());
    for (const int node : end(0.5)) {
        const Eigen::Vector3d expected =
            R * Eigen::Vector3d(box.body.tets.X.row(node)) + Eigen::Vector3d(0.1, 0, 0);
        EXPECT_LT((world.state(0).x.row(node).transpose() - expected).norm(), 1e-9);
    }
    for (const int node : end(-0.5))
        EXPECT_LT((world.state(0).x.row(node) - box.body.tets.X.row(node)).norm(), 1e-9);
    const double held = world.state(0).x(end(0.5).front(), 0);
    for (int i = 0; i < 60; ++i) ASSERT_EQ(world.step(5e-3).failure, "");
    EXPECT_LT(world.state(0).x(end(0.5).front(), 0), held - 0.01);  // springs back after the release
}

TEST(World, ContinuesFromASnapshotWithTheSameBits) {
    const Model box({0.6, 0.4, 0.3}, {3, 2, 2}, {.young = 2e4});
    const auto build = [&] {
        auto world = std::make_unique<World>(WorldConfig{});
        world->add_obstacle(floor_at(0));
        world->add_body(box.at({0, 0, 0.16}));
        world->add_body(box.at({0.1, 0.05, 0.5}, turned(0.3)));
        return world;
    };
    const auto world = build(), resumed = build();
    WorldSnapshot snapshot;
    for (int i = 0; i < 80; ++i) {
        if (i == 40) snapshot = world->snapshot();
        world->step(5e-3);
    }
    ASSERT_GT(snapshot.stretches.contacts.size(), 4u);
    resumed->restore(snapshot);
    for (int i = 40; i < 80; ++i) resumed->step(5e-3);
    for (int b : {0, 1}) {
        EXPECT_TRUE(resumed->state(b).x == world->state(b).x);
        EXPECT_TRUE(resumed->state(b).v == world->state(b).v);
    }
    EXPECT_EQ(resumed->time(), world->time());
    EXPECT_EQ(resumed->snapshot().stretches.contacts, world->snapshot().stretches.contacts);

    WorldSnapshot wrong = snapshot;
    wrong.before[1].v.conservativeResize(5, 3);
    EXPECT_EQ(test::refusal([&] { resumed->restore(wrong); }),
              "world: the snapshot of body 1 does not fit it");
    snapshot.bodies.pop_back();
    EXPECT_EQ(test::refusal([&] { resumed->restore(snapshot); }), "world: a snapshot of 1 bodies for 2");
}

TEST(World, TheSolverStartsWhereVelocitiesHeadFor) {
    const Model box({0.6, 0.4, 0.3}, {6, 4, 3}, {.young = 2e4});
    const auto build = [&] {
        auto world =
            std::make_unique<World>(WorldConfig{.step = {.integrator = TimeIntegrator::backward_euler}});
        WorldBody body = box.at({0, 0, 0});
        const Nodes& X = box.elastic->rest().X;
        body.grips.push_back(
            {.nodes = test::nodes_where(X, [&](const auto& p) { return p[0] == X.col(0).minCoeff(); })});
        world->add_body(std::move(body));
        return world;
    };
    const auto world = build(), forgetful = build();
    int known = 0, forgotten = 0;
    for (int i = 0; i < 40; ++i) {
        WorldSnapshot snapshot = world->snapshot();
        snapshot.before.clear();
        forgetful->restore(snapshot);
        known += world->step(2e-3).solver_iterations;
        forgotten += forgetful->step(2e-3).solver_iterations;
        const double size = world->state(0).v.norm();
        EXPECT_LT((world->state(0).v - forgetful->state(0).v).norm(), 1e-4 * size) << i;
    }
    EXPECT_LT(known, forgotten);
}

TEST(World, ContactForcesBalanceTheWeightAndCancelBetweenBodies) {
    const Model box({0.6, 0.4, 0.3}, {3, 2, 2}, {.rayleigh_mass = 5});
    World world(WorldConfig{});
    world.add_obstacle(floor_at(0));
    world.add_body(box.at({0, 0, 0.153}));
    world.add_body(box.at({0, 0, 0.46}));
    for (int i = 0; i < 400; ++i) ASSERT_EQ(world.step(5e-3).failure, "");
    const double weight = 9.81 * box.elastic->mass();
    const Eigen::Vector3d below = world.contact_forces(0).colwise().sum(),
                          above = world.contact_forces(1).colwise().sum();
    EXPECT_NEAR(above.z(), weight, 0.01 * weight);
    EXPECT_NEAR(below.z(), weight, 0.01 * weight);  // two weights from the floor, minus one from above
    EXPECT_LT(above.head(2).norm() + below.head(2).norm(), 0.01 * weight);
}

TEST(World, TellsWhichFacesOfTwoBodiesAreNear) {
    const Model box({0.6, 0.4, 0.3}, {3, 2, 2});
    World world(WorldConfig{});
    world.add_body(box.at({0, 0, 0}));
    world.add_body(box.at({0.31, 0.2, 0.11}, turned(0.3)));
    const std::size_t intersecting = world.within(0, 1, 0).size();
    EXPECT_GT(intersecting, 5u);
    EXPECT_GT(world.within(0, 1, 0.05).size(), intersecting);
}

TEST(World, AMovingSpherePushesABodyAway) {
    const Model box({0.4, 0.4, 0.4}, {3, 3, 3});
    World world(WorldConfig{.gravity = Eigen::Vector3d::Zero()});
    world.add_obstacle(
        {.shape = BallShape{.centre = {-0.6, 0, 0}, .radius = 0.3}, .motion = travel({1, 0, 0})});
    world.add_body(box.at({0, 0, 0}));
    for (int i = 0; i < 100; ++i) {
        const WorldReport report = world.step(5e-3);
        ASSERT_EQ(report.failure, "");
        EXPECT_GT(report.least_distance, 0);
    }
    EXPECT_GT(linear_momentum(world, 0).x() / box.elastic->mass(), 0.5);
}

TEST(World, RejectsInvalidBodiesAndObstacles) {
    const Model box({0.4, 0.4, 0.4}, {1, 1, 1});
    World world(WorldConfig{});
    EXPECT_EQ(test::refusal([&] { world.step(0); }), "world: dt is 0, but must be > 0");
    WorldBody entry = box.at({0, 0, 0});
    entry.grips = {{.nodes = {0, 1}}, {.nodes = {1}}};
    EXPECT_EQ(test::refusal([&] { world.add_body(entry); }),
              "world: grips 0 and 1 of a body both hold node 1 at 0 s");
    entry.grips = {{.nodes = {8}}};
    EXPECT_EQ(test::refusal([&] { world.add_body(entry); }), "grip: node 8 is not in 0..7");
    const Model other({0.4, 0.4, 0.4}, {2, 1, 1});
    entry = box.at({0, 0, 0});
    entry.tree = other.tree;
    EXPECT_EQ(test::refusal([&] { world.add_body(entry); }),
              "world: a collision tree belongs to another surface than that of its body");
    EXPECT_EQ(test::refusal([&] { world.add_obstacle({.shape = BallShape{.radius = -1}}); }),
              "obstacle: a sphere needs a finite centre and a radius > 0, not -1");
    EXPECT_EQ(world.body_count(), 0);
}

TEST(World, GivesTheSameBitsInTwoRuns) {
    const Model box({0.6, 0.4, 0.3}, {3, 2, 2});
    const auto end = [&] {
        World world(WorldConfig{});
        world.add_obstacle(floor_at(0));
        world.add_body(box.at({0, 0, 0.16}));
        world.add_body(box.at({0.1, 0.05, 0.5}, turned(0.3)));
        for (int i = 0; i < 60; ++i) world.step(5e-3);
        return world.state(1).x;
    };
    EXPECT_TRUE(end() == end());
}

}  // namespace
}  // namespace nbd
