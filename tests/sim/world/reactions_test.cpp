#include "sim/world/reactions.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <memory>
#include <vector>

#include "meshing/body/make_body.hpp"
#include "meshing/surface/quadratic_tets.hpp"
#include "sim/world/world.hpp"
#include "tests/sim/support/momentum.hpp"
#include "tests/sim/world/box_model.hpp"
#include "tests/support/box_body.hpp"
#include "tests/support/box_mesh.hpp"

namespace nbd {
namespace {

using test::floor_at;
using test::Model;

constexpr double earth = 9.81;

/// With lumped masses, or with consistent ones.
Model model(const Eigen::Vector3d& size, const Eigen::Vector3i& cells, bool is_quadratic,
            const Material& material = {.young = 1e5, .rayleigh_mass = 0, .rayleigh_stiffness = 2e-3}) {
    if (!is_quadratic) return Model(size, cells, material);
    TetMesh mesh = make_quadratic(test::box_mesh(size, cells));
    mesh.X.rowwise() -= 0.5 * size.transpose();
    return Model(make_body("box", std::move(mesh), material, 1), true);
}

/// Holds the nodes in a box where they are, or moves them.
Grip held_in(const WorldBody& body, const Eigen::AlignedBox3d& box, Grip grip = {}) {
    for (int i = 0; i < body.state.x.rows(); ++i)
        if (box.contains(body.state.x.row(i).transpose())) grip.nodes.push_back(i);
    EXPECT_FALSE(grip.nodes.empty());
    return grip;
}

Eigen::AlignedBox3d beyond(int axis, double least) {
    Eigen::Vector3d low = Eigen::Vector3d::Constant(-9);
    low[axis] = least;
    return {low, Eigen::Vector3d::Constant(9)};
}

Eigen::Vector3d weight(const World& world, int body) { return {0, 0, -earth * world.elastic(body).mass()}; }

Reaction only(const World& world) {
    const std::vector<Reaction> all = world.reactions();
    EXPECT_EQ(all.size(), 1u);
    return all.empty() ? Reaction{} : all[0];
}

void settle(World& world, int steps, double dt) {
    for (int i = 0; i < steps; ++i) ASSERT_EQ(world.step(dt).failure, "") << i;
}

/// On each body, of its weight, its outer forces, its loads and its reactions.
std::vector<Eigen::Vector3d> forces(World& world, const Eigen::Vector3d& loads) {
    std::vector<Eigen::Vector3d> sums;
    for (int b = 0; b < world.body_count(); ++b)
        sums.push_back(weight(world, b) + world.forces(b).colwise().sum().transpose() + loads);
    for (const Reaction& reaction : world.reactions()) {
        sums[reaction.body] += reaction.force;
        if (reaction.by == ReactionBy::body) sums[reaction.number] -= reaction.force;
    }
    return sums;
}

struct Rule {
    TimeIntegrator integrator;
    bool is_quadratic;
    int newton_iterations;
};

class Balance : public testing::TestWithParam<Rule> {
 protected:
    WorldConfig config() const {
        return {
            .step = {.integrator = GetParam().integrator, .newton_iterations = GetParam().newton_iterations}};
    }
    Model box(const Eigen::Vector3d& size = {0.4, 0.2, 0.2}) const {
        return model(size, {4, 2, 2}, GetParam().is_quadratic);
    }
    /// Steps of different lengths.
    static void expect_balance(World& world, int steps, double dt,
                               const Eigen::Vector3d& loads = Eigen::Vector3d::Zero()) {
        std::vector<Eigen::Vector3d> impulse(world.body_count(), Eigen::Vector3d::Zero()), start;
        std::vector<double> largest(world.body_count(), 0.0);
        for (int b = 0; b < world.body_count(); ++b) start.push_back(test::linear_momentum(world, b));
        for (int i = 0; i < steps; ++i) {
            const double length = i % 7 == 3 ? 0.6 * dt : dt;
            const WorldReport report = world.step(length);
            ASSERT_EQ(report.failure, "") << i;
            const std::vector<Eigen::Vector3d> sums = forces(world, loads);
            for (int b = 0; b < world.body_count(); ++b) {
                impulse[b] += length * sums[b];
                largest[b] += length * weight(world, b).norm();
                const Eigen::Vector3d off = test::linear_momentum(world, b) - start[b] - impulse[b];
                ASSERT_LT(off.norm(), 1e-6 * largest[b]) << "body " << b << " step " << i;
            }
        }
    }
};

TEST_P(Balance, OfAFreeBody) {
    World world(config());
    world.add_body(box().at({0, 0, 1}, test::turned(0.4), {1, 2, 3}));
    world.forces(0).row(3) << 2, 1, -1;
    expect_balance(world, 30, 5e-3);
    EXPECT_TRUE(world.reactions().empty());
}

TEST_P(Balance, OfABodyThatSwingsFromPins) {
    World world(config());
    WorldBody body = box().at({0, 0, 0});
    body.grips = {held_in(body, beyond(0, 0.19))};
    world.add_body(std::move(body));
    expect_balance(world, 60, 5e-3);
    EXPECT_EQ(only(world).by, ReactionBy::grip);
}

/// Arms are those of one time in a step that turns the body, so that torques are as exact as the steps.
TEST_P(Balance, OfTheAngularMomentumOfASwingIsAsExactAsTheSteps) {
    const auto off = [&](double dt) {
        World world(config());
        WorldBody body = box().at({0, 0, 0});
        body.grips = {held_in(body, beyond(0, 0.19))};
        world.add_body(std::move(body));
        Eigen::Vector3d sum = Eigen::Vector3d::Zero(), before = test::centre_of_mass(world, 0), turning = sum;
        double largest = 0;
        for (double time = 0; time < 0.2; time += dt) {
            EXPECT_EQ(world.step(dt).failure, "");
            const Eigen::Vector3d centre = test::centre_of_mass(world, 0);
            sum += dt * (only(world).torque + (centre + before).cross(weight(world, 0)) / 2);
            before = centre;
            turning = momentum_of(world.elastic(0), world.state(0)).angular +
                      centre.cross(test::linear_momentum(world, 0));
            largest = std::max(largest, turning.norm());
        }
        EXPECT_GT(largest, 0.1);
        return (turning - sum).norm() / largest;
    };
    const double coarse = off(5e-3), fine = off(2.5e-3);
    EXPECT_LT(coarse, 0.02);
    EXPECT_LT(fine, 0.7 * coarse);
}

TEST_P(Balance, OfABodyThatGripsMoveAndLetGo) {
    World world(config());
    WorldBody body = box().at({0, 0, 0});
    body.grips = {
        held_in(body, beyond(0, 0.19)),
        held_in(body, {Eigen::Vector3d(-9, -9, -9), Eigen::Vector3d(-0.19, 9, 9)},
                {.motion = eased({.translation = {0, 0.1, 0.05}, .duration = 0.1}), .release = 0.15})};
    world.add_body(std::move(body));
    expect_balance(world, 20, 5e-3);
    EXPECT_EQ(world.reactions().size(), 2u);
    expect_balance(world, 40, 5e-3);
    EXPECT_EQ(only(world).number, 0);
}

TEST_P(Balance, OfALoadedBodyOnPins) {
    World world(config());
    WorldBody body = box().at({0, 0, 0});
    body.grips = {held_in(body, beyond(0, 0.19))};
    const std::vector<int> end =
        held_in(body, {Eigen::Vector3d(-9, -9, -9), Eigen::Vector3d(-0.1, 9, 9)}).nodes;
    body.loads = {
        {.kind = LoadKind::force, .value = {3, -20, 5}, .nodes = end},
        {.kind = LoadKind::torque, .value = {0, 1, 1}, .nodes = end},
        {.kind = LoadKind::pressure, .pressure = 2e3, .factor = {.times = {0, 0.1}, .values = {0, 1}}}};
    world.add_body(std::move(body));
    expect_balance(world, 40, 5e-3, {3, -20, 5});
}

TEST_P(Balance, OfDrivenNodes) {
    World world(config());
    world.add_body(box().at({0, 0, 0}));
    const std::vector<int> nodes = held_in(box().at({0, 0, 0}), beyond(0, 0.19)).nodes;
    const Nodes start = world.state(0).x(nodes, Eigen::all);
    for (int i = 0; i < 5; ++i) {
        world.drive(0, nodes, start.rowwise() + Eigen::RowVector3d(0, 0.01 * i * i, 0));
        expect_balance(world, 2, 5e-3);
        EXPECT_EQ(only(world).by, ReactionBy::driven);
    }
}

TEST_P(Balance, OfBodiesThatPressEachOtherAPinnedOneAndTheFloor) {
    World world(config());
    world.add_obstacle(floor_at(0));
    WorldBody pinned = box().at({0.5, 0, 0.105});
    pinned.grips = {held_in(pinned, beyond(0, 0.69))};
    world.add_body(std::move(pinned));
    world.add_body(box().at({0, 0, 0.103}, Eigen::Matrix3d::Identity(), {0.3, 0, -0.1}));
    world.add_body(box().at({0.2, 0.02, 0.33}, test::turned(0.1), {0, 0, -1}));
    std::size_t most = 0;
    for (int i = 0; i < 12; ++i) {
        expect_balance(world, 5, 5e-3);
        most = std::max(most, world.reactions().size());
    }
    EXPECT_GT(most, 3u);
}

INSTANTIATE_TEST_SUITE_P(Rules, Balance,
                         testing::Values(Rule{TimeIntegrator::second_order, false, 1},
                                         Rule{TimeIntegrator::second_order, true, 1},
                                         Rule{TimeIntegrator::backward_euler, false, 1},
                                         Rule{TimeIntegrator::backward_euler, true, 1},
                                         Rule{TimeIntegrator::second_order, true, 20}));

TEST(Reactions, OfAPinnedBlockAtRestAreItsWeight) {
    for (const bool is_quadratic : {false, true})
        for (const double young : {1e5, 1e7}) {
            const Model box = model({0.4, 0.2, 0.2}, {3, 2, 2}, is_quadratic,
                                    {.young = young, .rayleigh_mass = 50, .rayleigh_stiffness = 5e-3});
            World world({});
            WorldBody body = box.at({0.3, 0.2, 0.1});
            body.grips = {held_in(body, beyond(2, 0.199))};
            world.add_body(std::move(body));
            settle(world, 400, 5e-3);
            const Reaction held = only(world);
            const Eigen::Vector3d w = weight(world, 0), arm = test::centre_of_mass(world, 0);
            EXPECT_LT((held.force + w).norm(), 1e-6 * w.norm()) << young;
            EXPECT_LT((held.torque + arm.cross(w)).norm(), 1e-5 * w.norm()) << young;
        }
}

/// By the lever rule, whatever the body's stiffness.
TEST(Reactions, ShareTheWeightOfABarOnTwoSupports) {
    for (const double a : {0.05, 0.25}) {  // of the second support from the middle
        const Model bar = model({1, 0.05, 0.1}, {20, 1, 2}, true,
                                {.young = 1e7, .rayleigh_mass = 20, .rayleigh_stiffness = 1e-3});
        World world({});
        WorldBody body = bar.at({0, 0, 0});
        const auto edge = [&](double x) {
            return held_in(body,
                           {Eigen::Vector3d(x - 1e-3, -9, -0.0501), Eigen::Vector3d(x + 1e-3, 9, -0.0499)});
        };
        body.grips = {edge(-0.5), edge(a)};
        world.add_body(std::move(body));
        settle(world, 500, 5e-3);
        const std::vector<Reaction> held = world.reactions();
        ASSERT_EQ(held.size(), 2u);
        const double w = -weight(world, 0)[2];
        EXPECT_EQ(held[0].number, 0);
        EXPECT_NEAR(held[0].force[2], w * a / (0.5 + a), 2e-3 * w);
        EXPECT_NEAR(held[1].force[2], w * 0.5 / (0.5 + a), 2e-3 * w);
        EXPECT_NEAR(held[0].force[2] + held[1].force[2], w, 1e-6 * w);
    }
}

TEST(Reactions, OfAClampAreTheMomentOfTheBarsWeight) {
    const double length = 0.6;
    const Model bar = model({length, 0.1, 0.1}, {12, 2, 2}, true,
                            {.young = 1e7, .rayleigh_mass = 20, .rayleigh_stiffness = 1e-3});
    World world({.linear = {.tolerance = 1e-8}, .origin = {100, 0, 0}});
    WorldBody body = bar.at({length / 2, 0, 0});
    body.grips = {held_in(body, {Eigen::Vector3d(-1, -1, -1), Eigen::Vector3d(1e-6, 1, 1)})};
    world.add_body(std::move(body));
    settle(world, 600, 5e-3);
    const Reaction held = only(world);
    const double w = -weight(world, 0)[2];
    EXPECT_NEAR(held.force[2], w, 1e-6 * w);
    // About the clamp; positions of this world are counted from x = 100.
    const Eigen::Vector3d moment = held.torque - Eigen::Vector3d(100, 0, 0).cross(held.force);
    EXPECT_NEAR(moment[1], -w * test::centre_of_mass(world, 0)[0], 1e-4 * w * length);
    EXPECT_NEAR(moment[1], -w * length / 2, 5e-3 * w * length);
}

TEST(Reactions, OfAFloorAndOfASlopeHoldABlock) {
    for (const double slope : {0.0, 0.2, 0.35}) {
        const Model box = model({0.3, 0.3, 0.2}, {2, 2, 2}, false, {.young = 1e6, .rayleigh_mass = 5});
        World world({.gravity = {earth * std::sin(slope), 0, -earth * std::cos(slope)}});
        world.add_obstacle({.shape = PlaneShape{.point = {0, 0, -3}}});
        world.add_obstacle(floor_at(0, 0.5));
        world.add_body(box.at({0, 0, 0.1002}));
        settle(world, 300, 5e-3);
        const Reaction pressed = only(world);
        EXPECT_EQ(pressed.by, ReactionBy::obstacle);
        EXPECT_EQ(pressed.number, 1);
        const double w = earth * world.elastic(0).mass();
        EXPECT_NEAR(pressed.force[2], w * std::cos(slope), 1e-5 * w);
        EXPECT_NEAR(pressed.force[0], -w * std::sin(slope), 1e-4 * w);
        const Eigen::Vector3d of_weight =
            test::centre_of_mass(world, 0).cross(Eigen::Vector3d(std::sin(slope), 0, -std::cos(slope)) * w);
        EXPECT_LT((pressed.torque + of_weight).norm(), 1e-4 * w);
    }
}

TEST(Reactions, OfTwoStackedBlocksAreTheWeightsAbove) {
    const Material material{.young = 1e6, .rayleigh_mass = 5};
    const Model below = model({0.3, 0.3, 0.2}, {2, 2, 2}, false, material),
                above = model({0.25, 0.2, 0.1}, {2, 2, 1}, false, material);
    World world({});
    world.add_obstacle(floor_at(0));
    world.add_body(above.at({0.02, 0, 0.2508}));
    world.add_body(below.at({0, 0, 0.1003}));
    settle(world, 400, 5e-3);
    const std::vector<Reaction> all = world.reactions();
    ASSERT_EQ(all.size(), 2u);
    const double upper = -weight(world, 0)[2], lower = -weight(world, 1)[2];
    EXPECT_EQ(all[0].by, ReactionBy::body);
    EXPECT_EQ(all[0].body, 0);
    EXPECT_EQ(all[0].number, 1);
    EXPECT_NEAR(all[0].force[2], upper, 2e-5 * upper);
    EXPECT_EQ(all[1].by, ReactionBy::obstacle);
    EXPECT_EQ(all[1].body, 1);
    EXPECT_NEAR(all[1].force[2], upper + lower, 1e-5 * (upper + lower));
}

TEST(Reactions, GoOnAfterARestoreWithTheSameBits) {
    const auto made = [] {
        World world({});
        world.add_obstacle(floor_at(0));
        WorldBody body = model({0.4, 0.2, 0.2}, {4, 2, 2}, true).at({0, 0, 0.102});
        body.grips = {
            held_in(body, beyond(0, 0.19), {.motion = eased({.translation = {0, 0, 0.1}, .duration = 0.2})})};
        world.add_body(std::move(body));
        return world;
    };
    World world = made(), again = made();
    settle(world, 10, 5e-3);
    again.restore(world.snapshot());
    EXPECT_TRUE(again.reactions().empty());
    for (int i = 0; i < 3; ++i) {
        settle(world, 1, 5e-3);
        settle(again, 1, 5e-3);
        const std::vector<Reaction> a = world.reactions(), b = again.reactions();
        ASSERT_EQ(a.size(), b.size());
        ASSERT_FALSE(a.empty());
        for (std::size_t k = 0; k < a.size(); ++k) {
            EXPECT_EQ(a[k].force, b[k].force);
            EXPECT_EQ(a[k].torque, b[k].torque);
        }
    }
}

}  // namespace
}  // namespace nbd
