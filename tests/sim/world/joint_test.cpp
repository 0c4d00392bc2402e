// Joints against closed forms.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <tuple>
#include <utility>

#include "meshing/body/rigid_body.hpp"
#include "sim/fem/momentum.hpp"
#include "sim/world/world.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/sim/support/momentum.hpp"
#include "tests/sim/world/box_model.hpp"

namespace nbd {
namespace {

using std::numbers::pi;
using test::floor_at;
using test::Model;

Model rigid_bar(const Eigen::Vector3d& size, double density = 1000) {
    TriMesh box = test::box(size[0], size[1], size[2], 2);
    box.X.rowwise() -= size.transpose() / 2;
    return Model(make_rigid_body("bar", std::move(box), density), true);
}

Eigen::Vector3d middle_of(const World& world, int body) {
    return centre_of_mass(world.elastic(body), world.state(body).x);
}

double energy_of(const WorldReport& report) {
    return report.kinetic_energy + report.elastic_energy + report.gravity_energy;
}

void spin(WorldBody& body, const Eigen::Vector3d& about, const Eigen::Vector3d& rate) {
    for (Eigen::Index i = 0; i < body.state.x.rows(); ++i)
        body.state.v.row(i) += rate.cross(body.state.x.row(i).transpose() - about).transpose();
}

/// Size, step.
class Pendulum : public ::testing::TestWithParam<std::tuple<double, double>> {};

/// A bar that hangs from its end by a ball joint or a hinge swings as the law of its amplitude says, and
/// hardly loses energy.
TEST_P(Pendulum, SwingsWithItsPeriod) {
    const auto [size, dt] = GetParam();
    for (const bool hinge : {false, true}) {
        const Model bar = rigid_bar(size * Eigen::Vector3d(0.1, 0.1, 1));
        World world(WorldConfig{});
        constexpr double amplitude = 0.5;
        const Eigen::Vector3d pivot(0.3 * size, 0, 0);
        const Eigen::Matrix3d R = Eigen::AngleAxisd(amplitude, Eigen::Vector3d::UnitY()).matrix();
        world.add_body(bar.at(pivot - R.col(2) * size / 2, R));
        if (hinge)
            world.add_joint({.kind = HingeJoint{.point = pivot, .axis = Eigen::Vector3d::UnitY()}});
        else
            world.add_joint({.kind = BallJoint{.point = pivot}});
        const double inertia = (1 + 0.01) / 12 + 0.25;  // of mass and length 1 about the end
        // The period of a swing of this amplitude, by the series of the elliptic integral.
        const double period = 2 * pi * std::sqrt(inertia * size / (0.5 * 9.81)) *
                              (1 + std::pow(amplitude, 2) / 16 + 11 * std::pow(amplitude, 4) / 3072);
        double first = NAN, before = 0, energy = NAN, last = NAN;
        int crossings = 0;
        double found = 0;
        while (world.time() < 3.4 * period) {
            const WorldReport report = world.step(dt);
            ASSERT_TRUE(test::is_balanced(report)) << report.rejection << report.failure;
            if (std::isnan(energy)) energy = energy_of(report);
            last = energy_of(report);
            const double side = middle_of(world, 0).x() - pivot.x();
            if (before < 0 && side >= 0) {
                const double at = world.time() - dt * side / (side - before);
                if (crossings++ == 0) first = at;
                found = (at - first) / std::max(crossings - 1, 1);
            }
            before = side;
        }
        ASSERT_GE(crossings, 3);
        EXPECT_NEAR(found, period, 0.005 * period);
        const double depth = bar.elastic->mass() * 9.81 * size / 2 * (1 - std::cos(amplitude));
        EXPECT_NEAR(last, energy, 0.02 * depth);
        EXPECT_LT((middle_of(world, 0) - pivot).norm(), size / 2 * (1 + 1e-4));
    }
}

INSTANTIATE_TEST_SUITE_P(Range, Pendulum,
                         ::testing::Values(std::tuple(0.2, 2e-3), std::tuple(0.01, 1e-3),
                                           std::tuple(10.0, 2e-2), std::tuple(0.2, 1e-4)));

/// A body swings on a spring about a hinge near and far from it.
TEST(Joint, AHingesSpringTurnsABodyFarFromIt) {
    for (const double arm : {0.3, 1.0, 3.0, 10.0}) {
        const Model box = rigid_bar({0.2, 0.2, 0.2});
        World world({.gravity = Eigen::Vector3d::Zero()});
        WorldBody body = box.at({arm, 0, 0});
        constexpr double rate = 10;  // rad/s
        spin(body, {0, 0, 0}, {0, 0.05 * rate, 0});
        const double inertia = box.elastic->mass() * (arm * arm + 2 * 0.04 / 12);
        world.add_body(std::move(body));
        world.add_joint({.kind = HingeJoint{.point = {0, 0, 0},
                                            .axis = Eigen::Vector3d::UnitY(),
                                            .angle = {.stiffness = inertia * rate * rate}}});
        constexpr double dt = 2e-3;
        int crossings = 0;
        double before = 0, last = 0;
        while (world.time() < 3.2 * 2 * pi / rate) {
            ASSERT_TRUE(test::is_balanced(world.step(dt)));
            const double angle = world.joint_value(0);
            if (before * angle < 0) {
                ++crossings;
                last = world.time() - dt * angle / (angle - before);
            }
            before = angle;
        }
        ASSERT_EQ(crossings, 6);
        EXPECT_NEAR(last, 6 * pi / rate, 0.005 * 6 * pi / rate) << arm;
    }
}

/// Also beyond half a turn.
TEST(Joint, AHingesSpringSwingsABodyBeyondHalfATurn) {
    const Model box = rigid_bar({0.2, 0.05, 0.05});
    World world({.gravity = Eigen::Vector3d::Zero()});
    world.add_body(box.at({0, 0, 0}));
    constexpr double rate = 2 * pi, rest = 2 * pi / 3;
    const double inertia = box.elastic->mass() * (0.04 + 0.0025) / 12;
    world.add_joint({.kind = HingeJoint{.point = {0, 0, 0},
                                        .axis = Eigen::Vector3d::UnitZ(),
                                        .angle = {.stiffness = inertia * rate * rate, .rest = rest}}});
    while (world.time() < 2) {
        ASSERT_TRUE(test::is_balanced(world.step(2e-3)));
        const double expected = rest * (1 - std::cos(rate * world.time()));
        ASSERT_NEAR(std::remainder(world.joint_value(0) - expected, 2 * pi), 0, 0.02) << world.time();
    }
}

/// What is beside a large body is held by a width of its own size.
TEST(Joint, AHingeOnALargeBodyHoldsASmallOne) {
    const Model rod = rigid_bar({0.02, 0.02, 0.2}), large = rigid_bar({180, 2, 2});
    World world(WorldConfig{});
    const Eigen::Vector3d axis = Eigen::Vector3d::UnitY();
    const Eigen::Matrix3d tilted = Eigen::AngleAxisd(-0.1, axis).matrix();
    world.add_body(rod.at(-0.1 * tilted.col(2), tilted));
    WorldBody held = large.at({90.1, 0, 0});
    held.grips = {Grip{.nodes = {0, 1, 2, 3}}};
    world.add_body(std::move(held));
    world.add_joint({.a = 0, .b = 1, .kind = HingeJoint{.point = {0, 0, 0}, .axis = axis}});
    for (int s = 0; s < 100; ++s) {
        ASSERT_TRUE(test::is_balanced(world.step(5e-3)));
        ASSERT_NEAR(test::centre_of_mass(world, 0).norm(), 0.1, 1e-5);
    }
}

/// A fast top on its tip precesses by m g r / (I3 spin).
TEST(Joint, ATopPrecesses) {
    const Model disc = rigid_bar({0.1, 0.1, 0.02}, 2000);
    World world(WorldConfig{});
    constexpr double tilt = 0.4, rate = 150, arm = 0.05, dt = 1e-3;
    const Eigen::Matrix3d R = Eigen::AngleAxisd(tilt, Eigen::Vector3d::UnitY()).matrix();
    WorldBody body = disc.at(arm * R.col(2), R);
    const RigidMatrix inertia = rigid_inertia(*disc.elastic, disc.body.tets.X);
    const double mass = disc.elastic->mass(), I3 = inertia(5, 5), I1 = inertia(3, 3) + mass * arm * arm;
    const double precession = mass * 9.81 * arm / (I3 * rate);  // where it is slow beside the spin
    // Steady: I3 spin w - (I1 - I3) w^2 cos(tilt) = m g r, from the slow root.
    double w = precession;
    for (int k = 0; k < 50; ++k) w = (mass * 9.81 * arm + (I1 - I3) * w * w * std::cos(tilt)) / (I3 * rate);
    spin(body, Eigen::Vector3d::Zero(),
         (rate - w * std::cos(tilt)) * R.col(2) + w * Eigen::Vector3d::UnitZ());
    world.add_body(std::move(body));
    world.add_joint({.kind = BallJoint{}});
    double angle = 0;
    Eigen::Vector3d last = middle_of(world, 0);
    for (int s = 0; s < 500; ++s) {
        ASSERT_TRUE(test::is_balanced(world.step(dt)));
        const Eigen::Vector3d now = middle_of(world, 0);
        angle += std::atan2(last.x() * now.y() - last.y() * now.x(), last.head<2>().dot(now.head<2>()));
        last = now;
    }
    EXPECT_NEAR(angle, 0.5 * w, 0.02 * 0.5 * w);
    EXPECT_NEAR(last.norm(), arm, 1e-4 * arm);
    EXPECT_NEAR(std::acos(last.z() / arm), tilt, 0.02);
}

/// Two bodies on a ball joint that nothing else touches keep their momenta.
TEST(Joint, KeepsMomentum) {
    for (const bool soft : {false, true}) {
        const Model heavy = rigid_bar({0.2, 0.1, 0.1}, 3000),
                    light = soft ? Model({0.2, 0.05, 0.05}, {4, 2, 2}, {.young = 1e5, .rayleigh_mass = 0})
                                 : rigid_bar({0.2, 0.05, 0.05});
        World world({.gravity = Eigen::Vector3d::Zero()});
        WorldBody a = heavy.at({0, 0, 0});
        spin(a, {0, 0, 0}, {1, 4, 2});
        world.add_body(std::move(a));
        world.add_body(light.at({0.2, 0, 0}, Eigen::Matrix3d::Identity(), {0.1, 0.4, -0.3}));
        world.add_joint({.a = 0, .b = 1, .kind = BallJoint{.point = {0.1, 0, 0}}});
        const auto linear = [&] {
            return Eigen::Vector3d(momentum_of(world.elastic(0), world.state(0)).linear +
                                   momentum_of(world.elastic(1), world.state(1)).linear);
        };
        const auto angular = [&] {
            Eigen::Vector3d sum = Eigen::Vector3d::Zero();
            for (const int b : {0, 1}) {
                const Momentum m = momentum_of(world.elastic(b), world.state(b));
                sum += m.angular + middle_of(world, b).cross(m.linear);
            }
            return sum;
        };
        const Eigen::Vector3d p = linear(), L = angular();
        for (int s = 0; s < 200; ++s) ASSERT_TRUE(test::is_balanced(world.step(2e-3)));
        EXPECT_LT((linear() - p).norm(), 1e-8 * p.norm());
        EXPECT_LT((angular() - L).norm(), 1e-3 * L.norm());
        EXPECT_LT((world.surface(0).colwise().minCoeff() - world.surface(1).colwise().maxCoeff()).norm(), 1);
    }
}

/// A mass on a spring along a slider.
TEST(Joint, ASpringSwingsOnASlider) {
    for (const double size : {0.01, 0.1, 1.0}) {
        const Model box = rigid_bar(size * Eigen::Vector3d(1, 1, 1));
        World world({.gravity = Eigen::Vector3d::Zero()});
        const Eigen::Vector3d axis = Eigen::Vector3d(1, 2, 0.5).normalized();
        const double mass = box.elastic->mass(), period = 0.2,
                     stiffness = mass * std::pow(2 * pi / period, 2);
        world.add_body(box.at({0, 0, 0}, Eigen::Matrix3d::Identity(), axis * size));
        const int joint =
            world.add_joint({.kind = SliderJoint{.axis = axis, .way = {.stiffness = stiffness}}});
        constexpr double dt = 1e-3;
        double most = 0;
        for (int s = 0; s < 250; ++s) {
            ASSERT_TRUE(test::is_balanced(world.step(dt)));
            const double exact = size * period / (2 * pi) * std::sin(2 * pi * world.time() / period);
            most = std::max(most, std::abs(world.joint_value(joint) - exact));
        }
        EXPECT_LT(most, 0.02 * size * period / (2 * pi));
        EXPECT_LT(axis.cross(middle_of(world, 0)).norm(), 1e-6 * size);
    }
}

TEST(Joint, ASliderStopsAtItsLimit) {
    const Model box = rigid_bar({0.1, 0.1, 0.1});
    World world({.step = {.integrator = TimeIntegrator::backward_euler}});
    world.add_body(box.at({0, 0, 1}));
    const int joint = world.add_joint({.kind = SliderJoint{.point = {0, 0, 1}, .way = {.least = -0.2}}});
    for (int s = 0; s < 200; ++s) ASSERT_TRUE(world.step(5e-3).failure.empty());
    EXPECT_NEAR(world.joint_value(joint), -0.2, 1e-4);
}

/// A motor turns a bar against gravity; limits hold another.
TEST(Joint, AMotorTurnsAHinge) {
    const Model bar = rigid_bar({0.3, 0.05, 0.05});
    World world(WorldConfig{});
    world.add_body(bar.at({0.15, 0, 0}));
    world.add_body(bar.at({0.15, 1, 0}));
    const Eigen::Vector3d axis(0, -1, 0);
    const int motor = world.add_joint(
        {.a = 0, .kind = HingeJoint{.axis = axis, .angle = {.motor = {.times = {0, 1}, .values = {0, 10}}}}});
    const int limited = world.add_joint(
        {.a = 1,
         .kind = HingeJoint{.point = {0, 1, 0}, .axis = axis, .angle = {.least = -0.3, .most = 0.2}}});
    for (int s = 0; s < 400; ++s) {
        ASSERT_TRUE(test::is_balanced(world.step(5e-3)));
        const double wanted = std::remainder(std::min(10 * world.time(), 10.0), 2 * pi);
        EXPECT_NEAR(std::remainder(world.joint_value(motor) - wanted, 2 * pi), 0, 2e-3);
    }
    EXPECT_GT(world.joint_value(limited), -0.31);
    EXPECT_LT(world.joint_value(limited), 0.21);
}

/// The same at a body that turns itself: a fan on a free body turns this one the other way round.
TEST(Joint, AMotorBetweenFreeBodiesTurnsBoth) {
    const Model fan = rigid_bar({0.3, 0.05, 0.02}), base = rigid_bar({0.2, 0.2, 0.1});
    World world({.gravity = Eigen::Vector3d::Zero()});
    world.add_body(fan.at({0, 0, 0.1}));
    world.add_body(base.at({0, 0, 0}));
    world.add_joint(
        {.a = 0,
         .b = 1,
         .kind = HingeJoint{.point = {0, 0, 0.08}, .angle = {.motor = {.times = {0, 1}, .values = {0, 6}}}}});
    for (int s = 0; s < 100; ++s) ASSERT_TRUE(test::is_balanced(world.step(5e-3)));
    const auto turning = [&](int b) {
        return Eigen::Vector3d(momentum_of(world.elastic(b), world.state(b)).angular);
    };
    const Eigen::Vector3d a = turning(0), b = turning(1);
    EXPECT_GT(a.z(), 0);
    EXPECT_LT((a + b).norm(), 1e-6 * a.norm());
    const double I = rigid_inertia(world.elastic(0), world.state(0).x)(5, 5),
                 J = rigid_inertia(world.elastic(1), world.state(1).x)(5, 5);
    EXPECT_NEAR(a.z() / I - b.z() / J, 6, 0.01 * 6);
}

/// Two halves of a bar that are welded sag as the whole one does.
TEST(Joint, AWeldHoldsHalvesLikeAWhole) {
    const Material material{.young = 1e6, .poisson = 0.3, .rayleigh_stiffness = 1e-2};
    const auto sag = [&](bool whole) {
        World world({.step = {.integrator = TimeIntegrator::backward_euler}});
        const Model one({0.8, 0.1, 0.1}, {16, 2, 2}, material), half({0.4, 0.1, 0.1}, {8, 2, 2}, material);
        const auto hold = [](WorldBody body, double end) {
            Grip grip;
            for (int i = 0; i < body.state.x.rows(); ++i)
                if (body.state.x(i, 0) < end + 1e-6) grip.nodes.push_back(i);
            body.grips = {grip};
            return body;
        };
        if (whole) {
            world.add_body(hold(one.at({0.4, 0, 0}), 0));
        } else {
            world.add_body(hold(half.at({0.2, 0, 0}), 0));
            world.add_body(half.at({0.6, 0, 0}));
            const Nodes x = world.state(1).x;
            std::vector<int> nodes;
            for (int i = 0; i < x.rows(); ++i)
                if (x(i, 0) < 0.4 + 1e-6) nodes.push_back(i);
            world.add_joint({.a = 1, .b = 0, .kind = WeldJoint{.places = x(nodes, Eigen::all)}});
        }
        for (int s = 0; s < 300; ++s) EXPECT_TRUE(world.step(1e-2).failure.empty());
        return -world.state(whole ? 0 : 1).x.col(2).minCoeff();
    };
    const double of_whole = sag(true);
    EXPECT_GT(of_whole, 0.052);
    EXPECT_NEAR(sag(false) - 0.05, of_whole - 0.05, 0.01 * (of_whole - 0.05));
}

/// A body on a rope falls freely, then swings at the rope's length.
TEST(Joint, ARopeIsSlackThenHolds) {
    const Model box = rigid_bar({0.1, 0.1, 0.1});
    World world(WorldConfig{});
    world.add_body(box.at({0.3, 0, -0.05}));
    world.add_joint(
        {.kind = CordJoint{.from = {0.3, 0, 0}, .to = {0, 0, 0}, .length = 0.5, .pulls_only = true}});
    for (int s = 0; s < 100; ++s) {
        ASSERT_TRUE(test::is_balanced(world.step(2e-3)));
        if (s == 80) {
            EXPECT_NEAR(middle_of(world, 0).z(), -0.05 - 9.81 / 2 * std::pow(81 * 2e-3, 2), 2e-3);
        }
    }
    double farthest = 0;
    for (int s = 0; s < 500; ++s) {
        ASSERT_TRUE(test::is_balanced(world.step(2e-3)));
        const Nodes x = world.surface(0);
        farthest = std::max(farthest, (x.colwise().mean()).norm());
    }
    EXPECT_LT(farthest, 0.5 + 0.05 * std::sqrt(3.0) + 1e-3);
    EXPECT_GT(farthest, 0.5);
}

/// The place that was at `place` in a rigid body when it had the pose x0.
Eigen::Vector3d carried_to(const World& world, int body, const Nodes& x0, const Eigen::Vector3d& place) {
    Eigen::Matrix4d before, now;
    for (int k = 0; k < 4; ++k) {
        before.col(k) << x0.row(k).transpose(), 1;
        now.col(k) << world.state(body).x.row(k).transpose(), 1;
    }
    return (now * before.partialPivLu().solve(Eigen::Vector4d(place.x(), place.y(), place.z(), 1))).head<3>();
}

/// A chain of ten links, the last of which is as heavy as they or a thousand times as heavy, swings down from
/// a level line: it holds together, gains no energy, and needs few linearisations.
TEST(Joint, AChainHoldsTogether) {
    for (const TimeIntegrator integrator : {TimeIntegrator::second_order, TimeIntegrator::backward_euler})
        for (const double density : {1e3, 5e4}) {
            const Model link = rigid_bar({0.1, 0.02, 0.02}), last = rigid_bar({0.1, 0.1, 0.1}, density);
            World world({.step = {.integrator = integrator}});
            for (int b = 0; b < 10; ++b) world.add_body(link.at({0.05 + 0.1 * b, 0, 0}));
            world.add_body(last.at({1.05, 0, 0}));
            std::vector<Nodes> start;
            for (int b = 0; b <= 10; ++b) start.push_back(world.state(b).x);
            world.add_joint({.a = 0, .kind = BallJoint{}});
            for (int b = 0; b < 10; ++b)
                world.add_joint({.a = b, .b = b + 1, .kind = BallJoint{.point = {0.1 * (b + 1), 0, 0}}});
            const double fall = 9.81 * (last.elastic->mass() + 5 * link.elastic->mass());  // over a metre
            double largest_gap = 0, most_energy = 0;
            int linearisations = 0;
            for (int s = 0; s < 400; ++s) {
                const WorldReport report = world.step(2.5e-3);
                ASSERT_TRUE(report.failure.empty()) << s << " " << report.failure;
                ASSERT_EQ(report.trouble, StepTrouble::none) << s << " " << report.trouble_reason;
                linearisations += report.newton_iterations;
                most_energy = std::max(most_energy, energy_of(report));
                for (int b = 0; b < 10; ++b) {
                    const Eigen::Vector3d place(0.1 * (b + 1), 0, 0);
                    largest_gap = std::max(largest_gap, (carried_to(world, b, start[b], place) -
                                                         carried_to(world, b + 1, start[b + 1], place))
                                                            .norm());
                }
            }
            EXPECT_LT(largest_gap, 2e-4) << density;
            EXPECT_LT(most_energy, 0.05 * fall) << density;
            EXPECT_LT(linearisations, 400 * 20) << density;
        }
}

/// A motor that turns a link by any angle a step moves it at its speed, with no more energy than that.
TEST(Joint, AFastMotorMakesNoEnergy) {
    for (const TimeIntegrator integrator : {TimeIntegrator::second_order, TimeIntegrator::backward_euler})
        for (const auto& [dt, rate] : {std::pair(0.05, 3.14), {0.02, 17.5}, {0.05, 17.5}}) {
            const Model bar = rigid_bar({0.2, 0.04, 0.04});
            World world({.step = {.integrator = integrator}});
            world.add_body(bar.at({0.1, 0, 0}));
            const double mass = bar.elastic->mass(), inertia = mass * 0.04 / 3;  // about its end
            world.add_joint(
                {.kind = HingeJoint{.axis = Eigen::Vector3d::UnitY(),
                                    .angle = {.motor = {.times = {0, 100}, .values = {0, 100 * rate}}}}});
            double most = 0;
            for (int s = 0; s < 100; ++s) {
                const WorldReport report = world.step(dt);
                ASSERT_TRUE(report.failure.empty()) << report.failure;
                if (s > 2) most = std::max(most, report.kinetic_energy);
            }
            const double expected = inertia * rate * rate / 2;
            EXPECT_LT(most, 3 * expected + mass * std::pow(9.81 * dt, 2)) << dt << " " << rate;
        }
}

/// A stiff damper stops a link, in either rule.
TEST(Joint, AStiffDamperMakesNoEnergy) {
    for (const double damping : {1.0, 1e3, 1e6, 1e9}) {
        const Model bar = rigid_bar({0.2, 0.04, 0.04});
        World world({.gravity = Eigen::Vector3d::Zero()});
        WorldBody body = bar.at({0.1, 0, 0});
        spin(body, {0, 0, 0}, {0, 50, 0});
        world.add_body(std::move(body));
        world.add_joint(
            {.kind = HingeJoint{.axis = Eigen::Vector3d::UnitY(), .angle = {.damping = damping}}});
        double before = std::numeric_limits<double>::infinity();
        for (int s = 0; s < 50; ++s) {
            const WorldReport report = world.step(5e-3);
            ASSERT_TRUE(report.failure.empty()) << report.failure;
            EXPECT_LT(report.kinetic_energy, before + 1e-4) << damping << " " << s;  // of 4 J
            before = report.kinetic_energy;
        }
        EXPECT_LT(before, 1e-6);
    }
}

TEST(Joint, BreaksAtItsStrength) {
    const Model box = rigid_bar({0.1, 0.1, 0.1});
    for (const double share : {0.9, 1.1}) {
        World world({.step = {.integrator = TimeIntegrator::backward_euler}});
        world.add_body(box.at({0, 0, 0}));
        const double weight = 9.81 * box.elastic->mass();
        const int joint =
            world.add_joint({.kind = BallJoint{.point = {0, 0, 0.05}}, .strength = share * weight});
        for (int s = 0; s < 100; ++s) world.step(5e-3);
        EXPECT_EQ(world.is_broken(joint), share < 1);
        const WorldSnapshot snapshot = world.snapshot();
        world.restore(snapshot);
        EXPECT_EQ(world.is_broken(joint), share < 1);
        EXPECT_EQ(middle_of(world, 0).z() < -0.1, share < 1);
    }
}

TEST(Joint, RefusesWhatIsWrong) {
    const Model box = rigid_bar({0.1, 0.1, 0.1}), soft({0.1, 0.1, 0.1}, {2, 2, 2});
    World world(WorldConfig{});
    world.add_body(box.at({0, 0, 0}));
    world.add_body(soft.at({1, 0, 0}));
    const auto refuses = [&](const Joint& joint) {
        EXPECT_THROW(world.add_joint(joint), std::invalid_argument);
        EXPECT_EQ(world.joint_count(), 0);
    };
    refuses({.a = 2});
    refuses({.a = 0, .b = 0});
    refuses({.a = 0, .b = 2});
    refuses({.kind = HingeJoint{.axis = Eigen::Vector3d::Zero()}});
    refuses({.kind = BallJoint{.point = {NAN, 0, 0}}});
    refuses({.a = 1, .kind = BallJoint{.point = {2, 0, 0}}});
    refuses({.kind = BallJoint{}, .strength = 0});
    refuses({.kind = WeldJoint{}});
    refuses({.kind = CordJoint{.from = {0, 0, 0}, .to = {0, 0, 0}}});
    refuses({.kind = SliderJoint{.way = {.least = 1, .most = 0}}});
    refuses({.kind = SliderJoint{.way = {.motor = {.times = {0, 0}, .values = {0, 1}}}}});
    refuses({.kind = HingeJoint{.angle = {.motor = {.times = {0}, .values = {0}}, .most = 1}}});
    refuses({.kind = HingeJoint{.angle = {.least = -1, .most = 4}}});
    refuses({.kind = HingeJoint{.angle = {.most = 1}}});
    refuses({.kind = HingeJoint{.angle = {.stiffness = 1, .rest = 4}}});
}

}  // namespace
}  // namespace nbd
