#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <string>
#include <tuple>

#include "sim/world/world.hpp"
#include "tests/sim/support/momentum.hpp"
#include "tests/sim/world/box_model.hpp"
#include "tests/support/box_mesh.hpp"

namespace nbd {
namespace {

using test::angular_momentum;
using test::centre_of_mass;
using test::linear_momentum;
using test::Model;

// Falls, throws and sags are told by the checks of nbdtree-bench physics (tests/bench).

TEST(FreeMotion, AFallNeedsNoIterations) {
    const Model box({0.2, 0.2, 0.2}, {2, 2, 2}, {.young = 1e4, .rayleigh_mass = 0});
    World world(WorldConfig{});
    world.add_body(box.at({0, 0, 0}));
    int iterations = 0;
    for (int s = 0; s < 20; ++s) {
        const WorldReport report = world.step(2e-3);
        ASSERT_EQ(report.failure + report.rejection + report.fallback, "");
        iterations += report.solver_iterations;
    }
    EXPECT_LE(iterations, 2);
    EXPECT_LT(world.state(0).v(0, 2), -0.3);
}

class SpinOfEveryLaw : public ::testing::TestWithParam<MaterialLaw> {
 protected:
    static Material of_this_law(double young, double damping) {
        return {.young = young, .rayleigh_mass = 0, .rayleigh_stiffness = damping, .law = GetParam()};
    }
};
INSTANTIATE_TEST_SUITE_P(Laws, SpinOfEveryLaw, ::testing::ValuesIn(material_laws),
                         [](const auto& test) { return std::string(name(test.param)); });

/// A bar that tumbles about no axis of its own; the rate in rad/s is for its ends.
TEST_P(SpinOfEveryLaw, AFreeBodyKeepsItsAngularMomentumWhateverTheDamping) {
    for (const double damping : {0.0, 1e-3, 0.1}) {
        const Model bar({0.6, 0.2, 0.1}, {4, 2, 1}, of_this_law(1e6, damping));
        for (const Tangent tangent : {Tangent::rotated, Tangent::full})
            for (const TimeIntegrator integrator :
                 {TimeIntegrator::backward_euler, TimeIntegrator::second_order})
                for (const double angle : {0.01, 0.1}) {  // a step
                    WorldConfig config{.gravity = {0, 0, -9.81}};
                    config.step.tangent = tangent;
                    config.step.integrator = integrator;
                    World world(config);
                    WorldBody body = bar.at({0, 0, 0});
                    const double dt = 2e-3;
                    const Eigen::Vector3d rate = angle / dt * Eigen::Vector3d(0.1, 1, 0.3).normalized();
                    for (Eigen::Index i = 0; i < body.state.v.rows(); ++i)
                        body.state.v.row(i) = rate.cross(Eigen::Vector3d(body.state.x.row(i)));
                    world.add_body(std::move(body));
                    const Momentum before = momentum_of(world.elastic(0), world.state(0));
                    for (int s = 0; s < 1000; ++s) ASSERT_EQ(world.step(dt).failure, "");
                    const Momentum after = momentum_of(world.elastic(0), world.state(0));
                    EXPECT_LT((after.angular - before.angular).norm(), 1e-4 * before.angular.norm())
                        << damping << ' ' << angle;
                }
    }
}

/// About the axis of the largest moment of inertia, where a spin is steady.
TEST_P(SpinOfEveryLaw, DampingOfStiffnessLeavesASpinAlone) {
    for (const double damping : {0.0, 0.1}) {
        const Model bar({0.6, 0.3, 0.1}, {4, 2, 1}, of_this_law(1e7, damping));
        WorldConfig config{.gravity = Eigen::Vector3d::Zero()};
        World world(config);
        WorldBody body = bar.at({0, 0, 0});
        const double dt = 2e-3;
        for (Eigen::Index i = 0; i < body.state.v.rows(); ++i)
            body.state.v.row(i) =
                Eigen::Vector3d(0, 0, 0.02 / dt).cross(Eigen::Vector3d(body.state.x.row(i)));
        world.add_body(std::move(body));
        double settled = 0, energy = 0;
        for (int s = 0; s < 1000; ++s) {
            const WorldReport report = world.step(dt);
            energy = report.kinetic_energy + report.elastic_energy;
            if (s == 500) settled = energy;
        }
        ASSERT_GT(settled, 1);
        EXPECT_NEAR(energy, settled, 1e-4 * settled) << damping;
    }
}

/// Step, friction.
class Collision : public ::testing::TestWithParam<std::tuple<double, double>> {};

TEST_P(Collision, KeepsMomenta) {
    const auto [dt, friction] = GetParam();
    WorldConfig config{.gravity = Eigen::Vector3d::Zero()};
    config.contact.friction = friction;
    World world(config);
    test::add_colliding_boxes(world);
    const Eigen::Vector3d p = linear_momentum(world), p0 = linear_momentum(world, 0),
                          L = angular_momentum(world), L0 = angular_momentum(world, 0);
    double energy = 0;
    int touched = 0;
    for (int s = 0; s * dt < 0.5; ++s) {
        const WorldReport report = world.step(dt);
        ASSERT_EQ(report.failure, "");
        const double now = report.kinetic_energy + report.elastic_energy;
        if (s == 0) energy = now;
        EXPECT_LE(now, energy * (1 + 1e-6));
        touched += report.contacts > 0;
        const Nodes &forces = world.contact_forces(0), &others = world.contact_forces(1);
        EXPECT_LT((forces.colwise().sum() + others.colwise().sum()).norm(), 1e-9 * (1 + forces.norm()));
    }
    EXPECT_GT(touched, 3);
    ASSERT_GT((linear_momentum(world, 0) - p0).norm(), 0.2 * p0.norm());
    ASSERT_GT((angular_momentum(world, 0) - L0).norm(), 0.01 * L0.norm());
    EXPECT_LT((linear_momentum(world) - p).norm(), 1e-9 * p0.norm());
    EXPECT_LT((angular_momentum(world) - L).norm(), 1e-3 * (angular_momentum(world, 0) - L0).norm());
}

INSTANTIATE_TEST_SUITE_P(, Collision,
                         ::testing::Combine(::testing::Values(5e-4, 5e-3), ::testing::Values(0.0, 0.5)));

/// Sound crosses these bodies up to 7,000 times in a step: they turn as rigid ones do.
TEST(FreeMotion, AStiffBodyTurnsWithoutStrain) {
    for (const auto& [size, dt, young] :
         {std::tuple(0.1, 0.05, 1e9), std::tuple(0.1, 0.05, 2e11), std::tuple(0.01, 5e-3, 2e11),
          std::tuple(10.0, 0.02, 2e11), std::tuple(0.01, 0.02, 1e9)}) {
        const Model cube({size, size, size}, {2, 2, 2}, {.young = young, .rayleigh_mass = 0});
        World world({.gravity = {0, 0, 0}});
        WorldBody body = cube.at({0, 0, 0});
        const Eigen::RowVector3d spin(1, 2, 3);
        body.state.v = -body.state.x.rowwise().cross(spin);
        world.add_body(body);
        const double begin = kinetic_energy(*cube.elastic, world.state(0).v);
        for (int s = 0; s < 40; ++s) {
            const WorldReport report = world.step(dt);
            ASSERT_EQ(report.failure, "") << size << ' ' << dt << ' ' << young;
            EXPECT_NEAR(report.kinetic_energy / begin, 1, 0.02)
                << size << ' ' << dt << ' ' << young << ' ' << s;
            const double strain =
                std::sqrt(2 * report.elastic_energy / (young * std::pow(size, 3)));  // in the mean
            EXPECT_LT(strain, s > 2 ? 1e-4 : 3e-4) << size << ' ' << dt << ' ' << young << ' ' << s;
        }
    }
}

/// Blocks and bars of other moments about each axis turn far in each step, for a hundred steps, also in
/// flight: they keep their kinetic energy, and one linearisation does where they are soft.
TEST(FreeMotion, DeformableBodiesThatTurnFarInAStepKeepTheirEnergy) {
    for (const Eigen::Vector3d& size : {Eigen::Vector3d(0.1, 0.1, 0.1), {0.1, 0.02, 0.01}})
        for (const double young : {1e6, 1e8})
            for (const double turn : {0.1, 0.3, 0.45, 0.8, 1.6})
                for (const double flight : {0.0, 100.0}) {
                    const double dt = 0.05;
                    const Model block(size, {3, 1, 1}, {.young = young, .rayleigh_mass = 0});
                    World world({.gravity = {0, 0, 0}});
                    WorldBody body = block.at({0, 0, 0});
                    const Eigen::RowVector3d spin(0, 0, turn / dt), along(flight, 0, 0);
                    body.state.v = (-body.state.x.rowwise().cross(spin)).rowwise() + along;
                    world.add_body(body);
                    const auto turning = [&] {
                        return kinetic_energy(*block.elastic, world.state(0).v.rowwise() - along);
                    };
                    const double begin = turning();
                    const std::string at =
                        fmt::format("{} m, {} Pa, {} rad, {} m/s", size[1], young, turn, flight);
                    for (int s = 0; s < 100; ++s) {
                        const WorldReport report = world.step(dt);
                        ASSERT_EQ(report.failure, "") << at;
                        if (s < 4) continue;  // rates before the first are not known
                        ASSERT_NEAR(turning() / begin, 1, turn < 0.4 ? 0.02 : 0.1) << at << ' ' << s;
                        ASSERT_LT(report.elastic_energy, (turn < 0.7 ? 0.05 : 0.2) * begin) << at << ' ' << s;
                    }
                }
}

TEST(FreeMotion, APinnedBlockSagsAsFarInOneLinearisationAsByNewton) {
    for (const double dt : {1e-4, 1e-2}) {
        const Model block({0.2, 0.2, 0.2}, {2, 2, 2});
        const auto sag = [&](bool is_newton) {
            WorldConfig config;
            if (is_newton) config.step = {.newton_iterations = 30, .newton_tolerance = 1e-9};
            World world(config);
            WorldBody body = block.at({0, 0, 0});
            body.grips.push_back({.nodes = test::nodes_where(
                                      body.state.x, [](const Eigen::Vector3d& x) { return x.z() > 0.099; })});
            world.add_body(body);
            const double before = centre_of_mass(world, 0).z();
            for (int i = 0; i < 40; ++i) EXPECT_EQ(world.step(dt).rejection, "");
            return before - centre_of_mass(world, 0).z();
        };
        const double expected = sag(true);
        ASSERT_GT(expected, 1e-6);
        EXPECT_NEAR(sag(false), expected, 1e-3 * expected) << dt;
    }
}

/// Two boxes that meet with nearly parallel edges, far from the origin.
TEST(FreeMotion, BodiesThatMeetAtParallelEdgesKeepTheirAngularMomentum) {
    const Model box({1, 0.3, 0.3}, {3, 1, 1}, {.young = 1e5, .rayleigh_mass = 0});
    const Eigen::Vector3d origin(2000, -1000, 0);
    const Eigen::Matrix3d on_edge = Eigen::AngleAxisd(std::atan(1.0), Eigen::Vector3d::UnitX()).matrix();
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.01, Eigen::Vector3d(0, 0.5, 1).normalized()).matrix();
    World world(WorldConfig{.gravity = Eigen::Vector3d::Zero()});
    world.add_body(box.at(origin, on_edge, {0, 0, 1}));
    world.add_body(box.at(origin + Eigen::Vector3d(0.3, 0, 0.45), turn * on_edge, {0, 0, -1}));
    const Eigen::Vector3d before = angular_momentum(world, origin);
    const double mass = world.elastic(0).mass();
    double largest = 0, off = 0;
    for (int i = 0; i < 100; ++i) {
        EXPECT_EQ(world.step(2e-3).failure, "");
        largest = std::max(largest, angular_momentum(world, 0, centre_of_mass(world, 0)).norm());
        off = std::max(off, (angular_momentum(world, origin) - before).norm());
    }
    EXPECT_LT(off, 2e-3 * largest);
    EXPECT_GT(largest, 1e-2 * mass);  // the hit is off their centres
    EXPECT_LT(largest, mass);
}

}  // namespace
}  // namespace nbd
