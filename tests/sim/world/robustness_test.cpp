// Difficult cases for the simulator: crushed, fast and piled bodies.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "collision/base/counter_random.hpp"
#include "sim/materials/polar.hpp"
#include "tests/sim/support/one_body_world.hpp"
#include "tests/sim/world/box_model.hpp"
#include "tests/support/box_mesh.hpp"

namespace nbd {
namespace {

using test::floor_at;
using test::Model;
using test::turned;

TEST(Robustness, ABodySqueezedToHalfItsHeightStaysBetweenThePlatesAndComesToRest) {
    const Model box({0.4, 0.4, 0.4}, {4, 4, 4}, {.rayleigh_mass = 5});
    World world(WorldConfig{});
    world.add_obstacle(floor_at(-0.201, 0.3));
    world.add_obstacle({.shape = PlaneShape{.point = {0, 0, 0.21}, .normal = -Eigen::Vector3d::UnitZ()},
                        .motion = travel({0, 0, -0.7}, 0, 0.3),
                        .friction = 0.3});
    world.add_body(box.at({0, 0, 0}));
    double fastest = 0;
    WorldReport report;
    for (int i = 0; i < 160; ++i) {
        report = world.step(5e-3);
        ASSERT_EQ(report.failure, "");
        fastest = std::max(fastest, report.kinetic_energy);
    }
    const auto z = world.state(0).x.col(2);
    EXPECT_NEAR(z.maxCoeff() - z.minCoeff(), 0.2, 0.02);
    EXPECT_GT(report.least_distance, 0);
    EXPECT_EQ(report.inverted_elements, 0);
    EXPECT_GT(fastest, 1);
    EXPECT_LT(report.kinetic_energy, 1e-4 * fastest);
}

TEST(Robustness, TenBodiesPileUpAndComeToRest) {
    const Model box({0.2, 0.2, 0.2}, {1, 1, 1}, {.rayleigh_mass = 1});
    WorldConfig config;
    config.contact.friction = 0.6;
    World world(config);
    world.add_obstacle(floor_at(0, 0.6));
    for (int i = 0; i < 10; ++i)
        world.add_body(
            box.at({0.08 * std::cos(2.4 * i), 0.08 * std::sin(2.4 * i), 0.2 + 0.36 * i}, turned(0.7 * i)));
    double fastest = 0;
    WorldReport report;
    for (int i = 0; i < 600; ++i) {
        report = world.step(5e-3);
        ASSERT_EQ(report.failure, "");
        fastest = std::max(fastest, report.kinetic_energy);
    }
    EXPECT_TRUE(world.intersecting_faces().empty());
    EXPECT_GT(report.contacts, 20);
    EXPECT_LT(report.kinetic_energy, 5e-3 * fastest);
}

/// Largest distance of a node from its rest position under the best rigid motion, metres.
double deformation(const Nodes& X, const Nodes& x) {
    const Eigen::Vector3d from = X.colwise().mean(), to = x.colwise().mean();
    const Eigen::Matrix3d R =
        rotation_of((x.rowwise() - to.transpose()).transpose() * (X.rowwise() - from.transpose()));
    return (((X.rowwise() - from.transpose()) * R.transpose()).rowwise() + to.transpose() - x)
        .rowwise()
        .norm()
        .maxCoeff();
}

/// Crushed flat, or with nodes inside of it in disorder.
TEST(Robustness, ACrushedOrInvertedBodyRecoversItsShape) {
    const Model box({0.4, 0.3, 0.3}, {4, 3, 3});
    const auto end = [&](const auto& spoil, int least_inverted) {
        WorldBody entry = box.at({0, 0, 0});
        spoil(entry.state.x);
        EXPECT_GE(box.elastic->measure(entry.state.x).inverted, least_inverted);
        WorldConfig config{.gravity = Eigen::Vector3d::Zero()};
        config.limits.stretch = 50;
        World world(config);
        world.add_body(entry);
        WorldReport report;
        for (int i = 0; i < 500; ++i) {
            report = world.step(5e-3);
            EXPECT_EQ(report.failure, "");
        }
        EXPECT_EQ(report.inverted_elements, 0);
        return deformation(box.body.tets.X, world.state(0).x);
    };
    const int elements = box.elastic->element_count();
    EXPECT_LT(end([](Nodes& x) { x.col(2) *= 0.01; }, 0), 0.004);
    const auto is_inside = [](const Eigen::RowVector3d& x) {
        return (x.cwiseAbs().array() < Eigen::RowVector3d(0.19, 0.14, 0.14).array()).all();
    };
    EXPECT_LT(end(
                  [&](Nodes& x) {
                      for (Eigen::Index i = 0; i < x.rows(); ++i)
                          for (int k = 0; k < 3 && is_inside(box.body.tets.X.row(i)); ++k)
                              x(i, k) += 0.4 * (counter_uniform(7, k, i) - 0.5);
                  },
                  elements / 10),
              0.004);
}

TEST(Robustness, NewtonIterationsSolveTheStep) {
    const Model box({0.6, 0.2, 0.2}, {4, 2, 2}, {.young = 2e4});
    const double dt = 0.02;
    WorldConfig config;
    config.step = {
        .integrator = TimeIntegrator::backward_euler, .newton_iterations = 60, .newton_tolerance = 1e-7};
    World world(config);
    WorldBody entry = box.at({0, 0, 0});
    entry.grips = {
        {.nodes = test::nodes_where(box.body.tets.X, [](const auto& p) { return p.x() < -0.29; })}};
    const std::vector<int> held = entry.grips[0].nodes;
    world.add_body(entry);
    int most = 0;
    for (int i = 0; i < 10; ++i) {
        const BodyState start = world.state(0);
        const WorldReport report = world.step(dt);
        ASSERT_EQ(report.failure, "");
        EXPECT_EQ(report.substeps, 1) << report.rejection;
        most = std::max(most, report.newton_iterations);
        EXPECT_LT(test::step_residual(*box.elastic, start, world.state(0), dt,
                                      {.gravity = config.gravity, .forces = {}}, held),
                  1e-6);
    }
    EXPECT_GT(most, 2);
    EXPECT_GT((world.state(0).x - entry.state.x).cwiseAbs().maxCoeff(), 0.05);
}

TEST(Robustness, NewtonIterationsConvergeWithContact) {
    const Model box({0.6, 0.4, 0.3}, {3, 2, 2}, {.young = 3e4});
    WorldConfig config;
    config.step = {.newton_iterations = 30, .newton_tolerance = 1e-2};
    World world(config);
    world.add_obstacle(floor_at(0));
    world.add_body(box.at({0, 0, 0.16}));
    world.add_body(box.at({0.1, 0.05, 0.5}, turned(0.3)));
    int rejected_steps = 0, pressing = 0;
    for (int i = 0; i < 60; ++i) {
        const WorldReport report = world.step(5e-3);
        ASSERT_EQ(report.failure, "");
        rejected_steps += report.rejection.empty() ? 0 : 1;
        pressing = std::max(pressing, report.contacts);
    }
    EXPECT_LE(rejected_steps, 6);
    EXPECT_GT(pressing, 10);
}

/// A body let go at twice its size: the rotated tangent is too soft there, so that full steps of Newton's
/// iteration lead uphill. Without a line search it goes to and fro and never ends.
TEST(Robustness, NewtonIterationsDoNotGoUphill) {
    const Model box({0.6, 0.4, 0.3}, {3, 2, 2});
    const double dt = 0.1;
    WorldConfig config{.gravity = Eigen::Vector3d::Zero()};
    config.step = {.integrator = TimeIntegrator::backward_euler,
                   .newton_iterations = 100,
                   .newton_tolerance = 1e-6,
                   .max_substeps = 1};
    World world(config);
    WorldBody body = box.at({0, 0, 0});
    body.state.x *= 2;
    world.add_body(std::move(body));
    const BodyState start = world.state(0);
    const WorldReport report = world.step(dt);
    EXPECT_EQ(report.failure + report.rejection, "");
    EXPECT_GT(report.newton_iterations, 2);
    EXPECT_LT(test::step_residual(*box.elastic, start, world.state(0), dt,
                                  {.gravity = config.gravity, .forces = {}}),
              1e-4);
    EXPECT_GT((world.state(0).x - start.x).cwiseAbs().maxCoeff(), 0.2);
}

TEST(Robustness, ABlockSlidesOnSlopesAboveTheFrictionAngleAsCoulombsLawPredicts) {
    const Model box({0.4, 0.4, 0.2}, {2, 2, 1}, {.young = 1e6, .rayleigh_mass = 0});
    const double slope = 0.35, g = 9.81;  // tan 0.35 = 0.365
    for (const double friction : {0.1, 0.25, 0.6}) {
        // Tilts gravity and keeps the floor level.
        World world(WorldConfig{.gravity = {g * std::sin(slope), 0, -g * std::cos(slope)}});
        world.add_obstacle(floor_at(0, friction));
        world.add_body(box.at({0, 0, 0.104}));
        const auto speed = [&] { return world.state(0).v.col(0).mean(); };
        for (int i = 0; i < 100; ++i) ASSERT_EQ(world.step(5e-3).failure, "");
        const double before = speed();
        for (int i = 0; i < 100; ++i) ASSERT_EQ(world.step(5e-3).failure, "");
        const double expected = g * (std::sin(slope) - friction * std::cos(slope)),
                     travelled = world.state(0).x.col(0).mean();  // in a second
        if (expected > 0) {
            EXPECT_NEAR((speed() - before) / 0.5, expected, 0.02 * expected) << friction;
            EXPECT_NEAR(travelled, 0.5 * expected, 0.1 * 0.5 * expected) << "it hops where it lands";
        } else {
            EXPECT_LT(std::abs(travelled), 0.01) << friction;
        }
    }
}

}  // namespace
}  // namespace nbd
