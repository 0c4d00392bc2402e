// Motion in steps without intersections, against closed forms over sizes, steps and moduli.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <memory>
#include <string>

#include "sim/world/world.hpp"
#include "tests/sim/support/momentum.hpp"
#include "tests/sim/world/box_model.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/on_threads.hpp"

namespace nbd {
namespace {

using test::angular_momentum;
using test::centre_of_mass;
using test::linear_momentum;
using test::Model;
using test::turned;

constexpr double g = 9.81;

WorldConfig apart(const Eigen::Vector3d& gravity = {0, 0, -g}) {
    WorldConfig config{.gravity = gravity};
    config.contact.intersection_free = true;
    return config;
}

/// A body without damping by mass.
WorldBody without_damping(const Model& model, const Eigen::Vector3d& centre, const Eigen::Matrix3d& R,
                          const Eigen::Vector3d& velocity) {
    Material material = model.body.material;
    material.rayleigh_mass = 0;
    WorldBody body = model.at(centre, R, velocity);
    body.elastic = std::make_shared<const ElasticBody>(model.body.tets, material);
    return body;
}

/// Relative error of the height by which a block falls in some steps.
double fall_error(double size, double dt, double young, bool beside_a_fast_one,
                  const Eigen::Vector3d& origin = Eigen::Vector3d::Zero()) {
    constexpr int steps = 12;
    const Model block(size * Eigen::Vector3d(1, 0.8, 0.6), {2, 2, 1}, young),
        large(100 * size * Eigen::Vector3d::Ones(), {1, 1, 1}, young);
    World world(apart());
    const Eigen::Vector3d v0(12, 0, 3);
    world.add_body(without_damping(block, origin, turned(0.4), v0));
    if (beside_a_fast_one)
        world.add_body(
            without_damping(large, origin + Eigen::Vector3d(0, 200 * size, 0), turned(0), {100, 0, 0}));
    const Eigen::Vector3d before = centre_of_mass(world, 0);
    for (int i = 0; i < steps; ++i) {
        const WorldReport report = world.step(dt);
        EXPECT_EQ(report.failure + report.rejection, "");
    }
    const double fallen = g * dt * dt * steps * (steps + 1) / 2;
    const Eigen::Vector3d expected = before + steps * dt * v0 - Eigen::Vector3d(0, 0, fallen);
    return (centre_of_mass(world, 0) - expected).norm() / fallen;
}

TEST(ApartMotion, BlocksFallFreelyAtEverySizeStepAndStiffness) {
    for (const double size : {0.01, 0.2, 10.0})
        for (const double dt : {1e-4, 1e-3, 2e-2})
            for (const double young : {1e4, 1e9})
                for (const bool beside : {false, true})
                    EXPECT_LT(fall_error(size, dt, young, beside), 1e-6)
                        << size << ' ' << dt << ' ' << young << ' ' << beside;
}

TEST(ApartMotion, BlocksFallFarFromTheOrigin) {
    const Eigen::Vector3d far(1e6, -1e6, 1e6);
    for (const double young : {1e4, 1e9})
        for (const double dt : {1e-3, 2e-2})
            EXPECT_LT(fall_error(0.2, dt, young, false, far), 0.2 * 0x1p-33 / (g * dt * dt) + 1e-6) << young;
}

/// A block that hangs on its upper face, as in Newton's iteration of the default mode.
TEST(ApartMotion, APinnedBlockSagsAsInTheDefaultMode) {
    for (const double dt : {1e-4, 1e-2}) {
        const Model block({0.2, 0.2, 0.2}, {2, 2, 2});
        const auto sag = [&](bool is_apart) {
            WorldConfig config{.gravity = {0, 0, -g}};
            config.contact.intersection_free = is_apart;
            if (!is_apart) config.step = {.newton_iterations = 30, .newton_tolerance = 1e-9};
            World world(config);
            WorldBody body = block.at({0, 0, 0});
            body.grips.push_back({.nodes = test::nodes_where(
                                      body.state.x, [](const Eigen::Vector3d& x) { return x.z() > 0.099; })});
            world.add_body(body);
            const double before = centre_of_mass(world, 0).z();
            for (int i = 0; i < 40; ++i) EXPECT_EQ(world.step(dt).rejection, "");
            return before - centre_of_mass(world, 0).z();
        };
        const double expected = sag(false);
        ASSERT_GT(expected, 1e-6);
        EXPECT_NEAR(sag(true), expected, 1e-3 * expected) << dt;
    }
}

TEST(ApartMotion, CollidingBodiesKeepTheirMomentum) {
    for (const double dt : {5e-3, 5e-4}) {
        World world(apart(Eigen::Vector3d::Zero()));
        test::add_colliding_boxes(world);
        const Eigen::Vector3d before = linear_momentum(world);
        const double speed_before = linear_momentum(world, 0).x();
        int touched = 0;
        for (int i = 0; i < 0.25 / dt; ++i) {
            const WorldReport report = world.step(dt);
            EXPECT_EQ(report.failure, "");
            touched += report.contacts > 0;
            EXPECT_LT((linear_momentum(world) - before).norm(), 1e-9 * speed_before);
        }
        EXPECT_GT(touched, 3);
        EXPECT_LT(linear_momentum(world, 0).x(), 0.5 * speed_before);
    }
}

/// Two boxes that meet with nearly parallel edges, far from the origin.
TEST(ApartMotion, BodiesThatMeetAtParallelEdgesKeepTheirAngularMomentum) {
    const Model box({1, 0.3, 0.3}, {3, 1, 1});
    const Eigen::Vector3d origin(2000, -1000, 0);
    const Eigen::Matrix3d on_edge = Eigen::AngleAxisd(std::atan(1.0), Eigen::Vector3d::UnitX()).matrix();
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.01, Eigen::Vector3d(0, 0.5, 1).normalized()).matrix();
    World world(apart(Eigen::Vector3d::Zero()));
    world.add_body(without_damping(box, origin, on_edge, {0, 0, 1}));
    world.add_body(without_damping(box, origin + Eigen::Vector3d(0.3, 0, 0.45), turn * on_edge, {0, 0, -1}));
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
