// Static increments; more closed forms are told by the checks of nbdtree-bench physics (tests/bench).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <tuple>
#include <utility>
#include <vector>

#include "meshing/body/rigid_body.hpp"
#include "meshing/surface/quadratic_tets.hpp"
#include "sim/world/world.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/sim/world/box_model.hpp"
#include "tests/sim/world/static_world.hpp"
#include "tests/support/box_body.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/on_threads.hpp"

namespace nbd {
namespace {

using test::force_by;
using test::load_up;
using test::Model;
using test::static_config;

/// A beam of quadratic tetrahedra along x whose end at x = 0 a grip holds.
struct Cantilever {
    double length, height;
    Model model;
    std::vector<int> held, end;

    Cantilever(double L, double h, int cells, double young)
        : length(L),
          height(h),
          model(Model([&] {
              TetMesh mesh = make_quadratic(test::box_mesh({L, h, h}, {cells, 1, 1}));
              return test::boundary_body(std::move(mesh), {.young = young, .poisson = 0});
          }())),
          held(at(0)),
          end(at(L)) {}

    std::vector<int> at(double x) const {
        return test::nodes_where(model.body.tets.X,
                                 [&](const auto& p) { return std::abs(p[0] - x) < 1e-6 * length; });
    }
    double bending() const { return model.body.material.young * std::pow(height, 4) / 12; }

    WorldBody body(double load_at_end) const {
        WorldBody body = model.at({0, 0, 0});
        body.grips.push_back({.nodes = held});
        if (load_at_end != 0)
            body.loads.push_back({.kind = LoadKind::force, .value = {0, 0, -load_at_end}, .nodes = end});
        return body;
    }
    /// Displacement of the middle of the end.
    Eigen::Vector3d way(const World& world) const {
        const Nodes u = world.state(0).x - model.body.tets.X;
        return u(end, Eigen::all).colwise().mean();
    }
};

TEST(Statics, TheNumberOfIncrementsDoesNotMatter) {
    const Cantilever beam(1, 0.05, 20, 1e6);
    std::vector<Eigen::Vector3d> ways;
    for (const int increments : {1, 3, 10}) {
        World world(static_config({0, 0, 0}));
        world.add_body(beam.body(4 * beam.bending()));
        const WorldReport report = load_up(world, increments);
        ASSERT_EQ(report.failure, "");
        EXPECT_LE(report.imbalance, 1e-6);
        EXPECT_EQ(report.substeps, 1);
        EXPECT_EQ(report.kinetic_energy, 0);
        EXPECT_NEAR(force_by(world, 0, ReactionBy::grip).z(), 4 * beam.bending(), 4e-6 * beam.bending());
        ways.push_back(beam.way(world));
    }
    EXPECT_LT((ways[0] - ways[2]).norm(), 1e-5);
    EXPECT_LT((ways[1] - ways[2]).norm(), 1e-5);
}

/// Size, Young's modulus.
class StaticBlock : public ::testing::TestWithParam<std::tuple<double, double>> {};
INSTANTIATE_TEST_SUITE_P(Sizes, StaticBlock,
                         ::testing::Values(std::tuple(0.01, 1e9), std::tuple(1, 1e6), std::tuple(10, 1e3)));

/// Between plates without friction a block is in uniaxial stress: F = E A e, e of its own height.
TEST_P(StaticBlock, PressedBetweenPlates) {
    const auto [L, young] = GetParam();
    const Model block({L, L, L}, {3, 3, 3}, {.young = young, .poisson = 0.3});
    World world(static_config({0, 0, 0}));
    world.add_body(block.at({0, 0, L / 2 + 0.002 * L}));
    world.add_obstacle(test::floor_at(0, 0));
    Obstacle top{.shape = PlaneShape{.point = {0, 0, 1.004 * L}, .normal = {0, 0, -1}}, .friction = 0};
    top.motion = eased({.translation = {0, 0, -0.05 * L}, .duration = 1});
    world.add_obstacle(top);
    const WorldReport report = load_up(world, 5);
    ASSERT_EQ(report.failure, "");
    const Nodes& x = world.state(0).x;
    const auto mean_height = [&](double z) {
        double sum = 0;
        const std::vector<int> nodes = test::nodes_where(
            block.body.tets.X, [&](const auto& p) { return std::abs(p[2] - z) < 1e-6 * L; });
        for (const int node : nodes) sum += x(node, 2) / nodes.size();
        return sum;
    };
    const double e = 1 - (mean_height(L / 2) - mean_height(-L / 2)) / L;
    const double force = -force_by(world, 0, ReactionBy::obstacle, 1).z();
    EXPECT_GT(e, 0.04);
    EXPECT_NEAR(force / (young * L * L * e), 1, 1e-3);
    EXPECT_NEAR(force_by(world, 0, ReactionBy::obstacle, 0).z(), force, 1e-6 * force);
}

TEST(Statics, BlocksThatRestOnEachOtherCarryTheirWeight) {
    for (const double size : {0.02, 5.0}) {
        const Model block({size, size, size}, {2, 2, 2}, {.young = 1e6});
        World world(static_config());
        world.add_body(block.at({0, 0, 0.501 * size}));
        world.add_body(block.at({0.1 * size, 0, 1.503 * size}));
        world.add_obstacle(test::floor_at(0));
        const WorldReport report = load_up(world, 2);
        ASSERT_EQ(report.failure, "");
        const double weight = 9.81 * block.elastic->mass();
        EXPECT_NEAR(force_by(world, 0, ReactionBy::obstacle).z() / weight, 2, 1e-5);
        EXPECT_NEAR(force_by(world, 0, ReactionBy::body, 1).z() / weight, -1, 1e-5);
    }
}

TEST(Statics, WhatNothingHoldsIsTold) {
    const Model block({1, 1, 1}, {2, 2, 2}, {.young = 1e6});
    World world(static_config());
    world.add_body(block.at({0, 0, 0}));
    const WorldReport report = load_up(world, 2);
    EXPECT_THAT(report.failure, testing::HasSubstr("nothing holds body 0"));
    EXPECT_LT(report.newton_iterations, 100);
}

TEST(Statics, ARigidBodyHangsByARope) {
    for (const double size : {0.02, 4.0}) {
        TriMesh box = test::box(size, size, size, 2);
        box.X.array() -= size / 2;
        const Model weight(make_rigid_body("weight", std::move(box), 700), true);
        World world(static_config());
        world.add_body(weight.at({0, 0, 0}));
        // From a corner, so that it has to turn until the corner is above its centre.
        const Eigen::Vector3d corner = Eigen::Vector3d(0.5, 0.5, 0.5) * size, hook(0, 0, 2 * size);
        world.add_joint({.kind = CordJoint{.from = corner, .to = hook, .pulls_only = true}});
        const WorldReport report = load_up(world, 2);
        ASSERT_EQ(report.failure, "");
        const Eigen::RowVector3d centre = centre_of_mass(*weight.elastic, world.state(0).x);
        EXPECT_NEAR(centre.x(), 0, 1e-4 * size);
        EXPECT_NEAR(centre.y(), 0, 1e-4 * size);
        const double length = (corner - hook).norm() + corner.norm();
        EXPECT_NEAR(hook.z() - centre.z(), length, 0.01 * size);
        const double force = 9.81 * weight.elastic->mass();
        EXPECT_NEAR(force_by(world, 0, ReactionBy::joint).z(), force, 1e-5 * force);
    }
}

TEST(Statics, ASpringStretchesByWeightOverStiffnessWhateverItsDamping) {
    for (const double damping : {0.0, 1e3}) {
        TriMesh box = test::box(0.2, 0.2, 0.2, 2);
        box.X.array() -= 0.1;
        const Model weight(make_rigid_body("weight", std::move(box), 700), true);
        World world(static_config());
        world.add_body(weight.at({0, 0, 0}));
        world.add_joint(
            {.kind = CordJoint{.from = {0, 0, 0.1}, .to = {0, 0, 1}, .stiffness = 500, .damping = damping}});
        ASSERT_EQ(load_up(world, 3).failure, "");
        const double stretch = 9.81 * weight.elastic->mass() / 500;
        EXPECT_NEAR(-centre_of_mass(*weight.elastic, world.state(0).x).z(), stretch, 1e-5 * stretch);
    }
}

/// Two blocks on each other that a plate shears, with friction.
World sheared_stack() {
    static const Model block({0.2, 0.2, 0.1}, {3, 3, 2}, {.young = 1e5});
    World world(static_config());
    world.add_body(block.at({0, 0, 0.0502}));
    world.add_body(block.at({0.01, 0, 0.1506}));
    world.add_obstacle(test::floor_at(0));
    Obstacle top{.shape = PlaneShape{.point = {0, 0, 0.201}, .normal = {0, 0, -1}}, .friction = 0.5};
    top.motion = eased({.translation = {0.004, 0, -0.01}, .duration = 1});
    world.add_obstacle(top);
    return world;
}

TEST(Statics, TheSameBitsOnAnyNumberOfThreadsAndFromASnapshot) {
    const auto run = [] {
        World world = sheared_stack();
        const WorldReport report = load_up(world, 4);
        EXPECT_EQ(report.failure, "");
        return Nodes(world.state(1).x);
    };
    const Nodes once = test::on_threads(1, run), again = test::on_threads(2, run);
    EXPECT_TRUE(once == again);
    World world = sheared_stack(), other = sheared_stack();
    for (int k = 0; k < 2; ++k) ASSERT_EQ(world.step(0.25).failure, "");
    other.restore(world.snapshot());
    for (int k = 0; k < 2; ++k) ASSERT_EQ(other.step(0.25).failure, "");
    EXPECT_TRUE(other.state(1).x == once);
    const double shear = force_by(other, 1, ReactionBy::obstacle, 1).x();
    EXPECT_GT(shear, 1);
    EXPECT_NEAR(force_by(other, 0, ReactionBy::obstacle, 0).x(), -shear, 1e-4 * shear);
}

TEST(Statics, AnIncrementIsHalvedWhereItFindsNoBalance) {
    const Cantilever beam(1, 0.05, 20, 1e6);
    const auto after = [&](int linearisations, int parts) {
        WorldConfig config = static_config({0, 0, 0});
        config.statics->newton_iterations = linearisations;
        config.step.max_substeps = parts;
        World world(config);
        world.add_body(beam.body(4 * beam.bending()));
        const WorldReport report = load_up(world, 1);
        return std::pair(report, Nodes(world.state(0).x));
    };
    const Nodes x = after(200, 1).second;
    const auto [halved, y] = after(12, 8);
    EXPECT_EQ(halved.failure, "");
    EXPECT_GT(halved.substeps, 1);
    EXPECT_THAT(halved.rejection, testing::HasSubstr("body 0 is out of balance by"));
    EXPECT_LT((x - y).cwiseAbs().maxCoeff(), 1e-5);
    const auto [failed, z] = after(2, 4);
    EXPECT_THAT(failed.failure, testing::HasSubstr("of the load: body 0 is out of balance by"));
    EXPECT_THAT(failed.failure, testing::HasSubstr("the increment was cut into 4 parts"));
    EXPECT_TRUE(z == beam.model.body.tets.X);
}

TEST(Statics, ABodyThatATorqueTurnsIsHeldByNothing) {
    const Model block({1, 1, 1}, {2, 2, 2}, {.young = 1e6});
    World world(static_config({0, 0, 0}));
    WorldBody body = block.at({0, 0, 0});
    body.loads.push_back({.kind = LoadKind::torque, .value = {0, 0, 10}});
    world.add_body(body);
    EXPECT_THAT(load_up(world, 1).failure, testing::ContainsRegex("nothing holds (body 0|it)"));
}

/// A closed surface under pressure from all sides shrinks by p (1 - 2 nu) / E.
TEST(Statics, PressureShrinksABlockEvenly) {
    const Model block({0.1, 0.1, 0.1}, {2, 2, 2}, {.young = 1e6, .poisson = 0.3});
    World world(static_config({0, 0, 0}, 1e-8));
    WorldBody body = block.at({0, 0, 0});
    body.loads.push_back({.kind = LoadKind::pressure, .pressure = 1e3});
    world.add_body(body);
    ASSERT_EQ(load_up(world, 2).failure, "");
    const Nodes& x = world.state(0).x;
    const auto spread = [](const Nodes& nodes) {  // which does not change where the block turns
        return (nodes.rowwise() - nodes.colwise().mean()).norm();
    };
    const double shrunk = 1 - spread(x) / spread(block.body.tets.X);
    EXPECT_NEAR(shrunk, 1e3 * 0.4 / 1e6, 2e-6);  // the area shrinks, too
}

/// What is told is by how much of its scale each body is out of balance, also where one has no loads at all.
TEST(Statics, TheImbalanceIsWithinTheToleranceBesideAnUnloadedBody) {
    const Model block({0.1, 0.1, 0.1}, {2, 2, 2}, {.young = 1e6, .poisson = 0.3});
    World world(static_config({0, 0, 0}));
    for (const double load : {5.0, 0.0}) {
        WorldBody body = block.at({load, 0, 0});
        body.grips.push_back({.nodes = test::nodes_where(
                                  body.state.x, [](const Eigen::Vector3d& x) { return x.z() < -0.049; })});
        if (load > 0) body.loads.push_back({.kind = LoadKind::force, .value = {0, 0, load}});
        world.add_body(body);
    }
    for (int increment = 0; increment < 4; ++increment) {
        const WorldReport report = world.step(0.25);
        ASSERT_EQ(report.failure, "");
        EXPECT_LE(report.imbalance, StaticConfig{}.tolerance) << increment;
    }
}

TEST(Statics, ABodyComesBackWhereItsLoadGoes) {
    const Cantilever beam(1, 0.05, 20, 1e6);
    World world(static_config({0, 0, 0}));
    WorldBody body = beam.body(4 * beam.bending());
    body.loads[0].factor = {.times = {0, 0.5, 1}, .values = {0, 1, 0}};
    world.add_body(body);
    for (int k = 0; k < 2; ++k) ASSERT_EQ(world.step(0.25).failure, "");
    EXPECT_LT(beam.way(world).z(), -0.6);
    for (int k = 0; k < 2; ++k) ASSERT_EQ(world.step(0.25).failure, "");
    EXPECT_LT(beam.way(world).norm(), 1e-5);
}

TEST(Statics, BadTolerancesAreRefused) {
    for (const double tolerance : {0.0, 1.0, double(NAN)})
        EXPECT_THAT(test::error_of([&] {
                        World world(static_config({0, 0, -1}, tolerance));
                    }),
                    testing::HasSubstr("but must be between 1e-10 and 0.1"));
}

}  // namespace
}  // namespace nbd
