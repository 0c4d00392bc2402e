// Steps of second order against what is known of the rule.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>
#include <vector>

#include "sim/fem/momentum.hpp"
#include "sim/fem/step_system.hpp"
#include "tests/sim/support/momentum.hpp"
#include "tests/sim/support/one_body_world.hpp"
#include "tests/sim/world/box_model.hpp"
#include "tests/support/box_mesh.hpp"

namespace nbd {
namespace {

using test::OneBodyWorld;

/// Without Poisson's effect, a bar vibrates along itself alone.
const Material undamped{
    .young = 1e5, .poisson = 0, .density = 1000, .rayleigh_mass = 0, .rayleigh_stiffness = 0};

WorldConfig exact(TimeIntegrator integrator) {
    WorldConfig config = test::exact_steps(60, 1e-11);
    config.step.integrator = integrator;
    return config;
}

class RingingBar : public ::testing::Test {
 protected:
    static constexpr double length = 1;
    const ElasticBody body_{test::box_mesh({length, 0.3, 0.3}, {6, 2, 2}), undamped};
    // The first longitudinal vibration has half a wave on the bar.
    const double period_ = 2 * length / std::sqrt(undamped.young / undamped.density);

    BodyState stretched(double strain) const {
        BodyState state{body_.rest().X, Nodes::Zero(body_.node_count(), 3)};
        for (Eigen::Index i = 0; i < state.x.rows(); ++i)
            state.x(i, 0) -= strain * length / std::numbers::pi *
                             std::cos(std::numbers::pi * body_.rest().X(i, 0) / length);
        return state;
    }

    double energy(const BodyState& state) const {
        return body_.measure(state.x).energy + kinetic_energy(body_, state.v);
    }
};

TEST_F(RingingBar, KeepsItsEnergyWhereBackwardEulerLosesIt) {
    const BodyState start = stretched(0.05);
    double kept[2];
    for (const TimeIntegrator integrator : {TimeIntegrator::backward_euler, TimeIntegrator::second_order}) {
        OneBodyWorld world(body_, exact(integrator), start);
        world.steps(200, period_ / 100);  // two periods
        kept[integrator == TimeIntegrator::second_order] = energy(world.state()) / energy(start);
    }
    EXPECT_LT(kept[0], 0.6);
    EXPECT_GT(kept[1], 0.995);
    EXPECT_LE(kept[1], 1);
}

TEST_F(RingingBar, ConvergesToSecondOrder) {
    const BodyState start = stretched(0.05);
    // Where it is after pairs of steps of which the first has this share.
    const auto end_of = [&](TimeIntegrator integrator, int pairs, double first) {
        OneBodyWorld world(body_, exact(integrator), start);
        for (int k = 0; k < pairs; ++k)
            for (const double share : {first, 1 - first}) world.step(share * 0.3 * period_ / pairs);
        return world.state().x;
    };
    const Nodes truth = end_of(TimeIntegrator::second_order, 640, 0.5);
    for (const auto& [integrator, first, factor, slack] :
         {std::tuple(TimeIntegrator::backward_euler, 0.5, 2., 0.3),
          std::tuple(TimeIntegrator::second_order, 0.5, 4., 0.8),
          std::tuple(TimeIntegrator::second_order, 0.4, 4., 0.8)}) {
        const double coarse = (end_of(integrator, 20, first) - truth).norm(),
                     fine = (end_of(integrator, 40, first) - truth).norm();
        EXPECT_NEAR(coarse / fine, factor, slack) << first;
    }
}

// What was before a far shorter step counts no more.
TEST_F(RingingBar, StepsThatGrowTooMuchStartAnew) {
    const BodyState start = stretched(0.05);
    OneBodyWorld world(body_, exact(TimeIntegrator::second_order), start);
    world.step(1e-4);
    OneBodyWorld anew(body_, exact(TimeIntegrator::second_order), world.state());
    world.step(1e-3);
    anew.step(1e-3);
    EXPECT_LT((world.state().x - anew.state().x).norm(), 1e-6 * (world.state().x - start.x).norm());
}

TEST_F(RingingBar, GainsNoEnergyWhateverTheStepsAre) {
    const BodyState start = stretched(0.05);
    for (const std::vector<double>& pattern : {std::vector{1., 2.}, std::vector{1., 0.5, 0.25, 0.5},
                                               std::vector{1., 2., 4., 8.}, std::vector{1., 1.5, 0.3}})
        for (const double longest : {0.01, 0.1, 1.0}) {  // of a period
            WorldConfig config = exact(TimeIntegrator::second_order);
            config.step.newton_tolerance = 1e-4;
            OneBodyWorld world(body_, config, start);
            const double whole = energy(start);
            for (std::size_t s = 0; s < 60; ++s) {
                world.step(longest * period_ * pattern[s % pattern.size()] / std::ranges::max(pattern));
                ASSERT_LT(energy(world.state()), (1 + 1e-3) * whole)
                    << longest << ' ' << pattern.size() << ' ' << s;
            }
        }
}

TEST_F(RingingBar, KeepsLinearAndAngularMomentum) {
    BodyState start = stretched(0.1);
    for (Eigen::Index i = 0; i < start.v.rows(); ++i)
        start.v.row(i) = Eigen::Vector3d(1, 2, -1) +
                         Eigen::Vector3d(2, -3, 4).cross(Eigen::Vector3d(body_.rest().X.row(i)));
    for (const TimeIntegrator integrator : {TimeIntegrator::backward_euler, TimeIntegrator::second_order}) {
        OneBodyWorld world(body_, exact(integrator), start);
        world.steps(100, 0.004);
        const Eigen::Vector3d p = test::linear_momentum(body_, start.v),
                              l = test::angular_momentum(body_, start.x, start.v);
        EXPECT_LT((test::linear_momentum(body_, world.state().v) - p).norm(), 1e-10 * p.norm());
        EXPECT_LT((test::angular_momentum(body_, world.state().x, world.state().v) - l).norm(),
                  1e-10 * l.norm());
    }
}

TEST_F(RingingBar, GripsMoveAsTold) {
    const Grip end{.nodes = test::nodes_where(body_.rest().X, [](const auto& p) { return p[0] == 0; }),
                   .motion = eased({.translation = {0, 0.1, 0}, .duration = 0.05})};
    OneBodyWorld world(body_, exact(TimeIntegrator::second_order), {}, {end});
    world.steps(10, 0.01);
    for (const int node : end.nodes)
        EXPECT_LT(
            (world.state().x.row(node) - body_.rest().X.row(node) - Eigen::RowVector3d(0, 0.1, 0)).norm(),
            1e-12);
}

/// A box that falls, bounces and comes to rest.
World falling(TimeIntegrator integrator) {
    const test::Model model({0.3, 0.3, 0.3}, {3, 3, 3});
    World world({.step = {.integrator = integrator}});
    world.add_obstacle(test::floor_at(0));
    world.add_body(model.at({0, 0, 0.3}));
    return world;
}

/// Steps of two lengths, written out: v1 - v0 = dt (5/9 a1 + now a0 + before a(-1)), likewise x1 - x0, where
/// the forces are those of elasticity and damping.
TEST(SecondOrder, SolvesItsEquations) {
    Material damped = undamped;
    damped.rayleigh_stiffness = 0.01;
    const ElasticBody body(test::box_mesh({1, 0.3, 0.3}, {4, 2, 2}), damped);
    std::vector<BodyState> states{{body.rest().X, test::wild_field(body.rest().X, 1)}};
    OneBodyWorld world(body, exact(TimeIntegrator::second_order), states[0]);
    for (const double dt : {2e-3, 3e-3}) {
        world.step(dt);
        states.push_back(world.state());
    }
    const TwoStepWeights weights(1.5);
    const auto gain = [&](const auto& rate) -> Nodes {
        return 3e-3 *
               (5. / 9 * rate(states[2]) + weights.now * rate(states[1]) + weights.before * rate(states[0]));
    };
    const Nodes way = states[2].x - states[1].x, change = states[2].v - states[1].v;
    // The world turns velocities to keep the angular momentum.
    EXPECT_LT((way - gain([](const BodyState& s) { return s.v; })).norm(), 1e-3 * way.norm());
    const Nodes impulse = body.node_masses().asDiagonal() * change,
                expected = gain([&](const BodyState&s) { return body.inner_forces(s.x, s.v); });
    EXPECT_LT((impulse - expected).norm(), 1e-3 * impulse.norm());
}

TEST(SecondOrder, ThePotentialsGradientIsItsDerivative) {
    Material damped = undamped;
    damped.rayleigh_mass = 3;
    damped.rayleigh_stiffness = 0.01;
    const ElasticBody body(test::box_mesh({1, 0.5, 0.5}, {2, 1, 1}), damped);
    const Nodes& X = body.rest().X;
    StepStart start({X + test::wild_field(X, 0.02), test::wild_field(X, 1)});
    start.impulses = test::wild_field(X, 2);
    const Loads loads{.gravity = {0, 0, -9.81}, .forces = test::wild_field(X, 5)};
    ElementPose damping;
    ElementForces forces;
    const StepMotion motion{.w = start.v, .dt = 0.01, .damping = 1};
    body.pose(X, damping, forces, Tangent::rotated, &motion);
    StepPotential potential(body, start, {0.01, 1.6}, loads, damping);
    const Nodes v = test::wild_field(X, 0.7), along = test::wild_field(X.array() + 1, 1);
    constexpr double h = 1e-4;
    const double slope = (potential.value(v + h * along) - potential.value(v - h * along)) / (2 * h);
    EXPECT_NEAR(potential.gradient(v).cwiseProduct(along).sum(), slope, 1e-6 * std::abs(slope));
}

TEST(SecondOrder, AGripThatJumpsLeavesNoVelocityBehind) {
    const ElasticBody body(test::box_mesh({1, 0.3, 0.3}, {4, 2, 2}), undamped);
    const Grip end{.nodes = test::nodes_where(body.rest().X, [](const auto& p) { return p[0] == 0; }),
                   .motion = eased({.translation = {0, 0.01, 0}, .start = 0.001})};
    OneBodyWorld world(body, exact(TimeIntegrator::second_order), {}, {end});
    world.steps(5, 0.002);
    for (const int node : end.nodes) EXPECT_LT(world.state().v.row(node).norm(), 1e-9);
}

/// A bar that hangs by its end from rest, until it is let go.
World hanging(double release) {
    const test::Model model({1, 0.3, 0.3}, {4, 2, 2}, {.young = 1e5, .rayleigh_mass = 2});
    World world({.gravity = {9.81, 0, 0}});
    WorldBody body = model.at({0, 0, 0});
    body.grips = {{.nodes = test::nodes_where(model.body.tets.X, [](const auto& p) { return p.x() < -0.49; }),
                   .release = release}};
    world.add_body(std::move(body));
    return world;
}

/// Forces that held nodes do not push them after.
TEST(SecondOrder, AGripThatLetsGoLeavesNoForce) {
    World world = hanging(1), anew = hanging(1);
    while (world.time() < 1 - 1e-9) world.step(5e-3);
    WorldSnapshot snapshot = world.snapshot();
    snapshot.inner_forces.clear();
    snapshot.before.clear();
    anew.restore(snapshot);
    const Nodes held = world.state(0).v;
    world.step(5e-3);
    anew.step(5e-3);
    const Nodes fresh = anew.state(0).v;
    ASSERT_GT((fresh - held).norm(), 0.1);
    EXPECT_LT((world.state(0).v - fresh).norm(), 0.02 * (fresh - held).norm());
}

TEST(SecondOrder, ASnapshotKnowsWhatIsHeld) {
    World world = hanging(0.05);
    for (int s = 0; s < 20; ++s) {
        World other = hanging(0.05);
        other.restore(world.snapshot());
        world.step(5e-3);
        other.step(5e-3);
        ASSERT_EQ(world.state(0).x, other.state(0).x) << s;
    }
}

TEST(SecondOrder, AnImpactGainsNoEnergy) {
    World world = falling(TimeIntegrator::second_order);
    double first = 0;
    for (int s = 0; s < 200; ++s) {
        const WorldReport report = world.step(2e-3);
        ASSERT_EQ(report.failure, "");
        const double energy = report.kinetic_energy + report.elastic_energy + report.gravity_energy;
        if (s == 0) first = energy;
        ASSERT_LT(energy, first * (1 + 1e-3)) << s;
    }
    EXPECT_GT(world.state(0).x.col(2).minCoeff(), -0.01);
}

TEST(SecondOrder, ASnapshotContinuesWithTheSameBits) {
    World world = falling(TimeIntegrator::second_order), other = falling(TimeIntegrator::second_order);
    for (int s = 0; s < 20; ++s) world.step(2e-3);
    other.restore(world.snapshot());
    for (int s = 0; s < 150; ++s) {
        world.step(2e-3);
        other.step(2e-3);
        ASSERT_EQ(world.state(0).x, other.state(0).x) << s;
    }
}

}  // namespace
}  // namespace nbd
