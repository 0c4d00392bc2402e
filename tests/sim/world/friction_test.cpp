#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <stdexcept>

#include "meshing/body/embed.hpp"
#include "tests/sim/support/momentum.hpp"
#include "tests/sim/world/box_model.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/shapes.hpp"

namespace nbd {
namespace {

using test::Model;

// Coulomb's law in every step.

/// The block's mean contact force along and across the floor over a step, as friction and normal force.
struct Rub {
    double friction = 0, normal = 0;
};
Rub rub(const World& world, int body) {
    const Eigen::Vector3d force = world.contact_forces(body).colwise().sum();
    return {force.head<2>().norm(), force[2]};
}

TEST(Friction, OfALandingIsNeverMoreThanItsShareOfTheNormalForce) {
    const Model box({0.2, 0.2, 0.2}, {2, 2, 2});
    for (const double dt : {1e-3, 2e-3, 5e-3, 1e-2})
        for (const double mu : {0.1, 0.3}) {
            World world({});
            world.add_obstacle(test::floor_at(0, mu));
            world.add_body(box.at({0, 0, 0.2}, Eigen::Matrix3d::Identity(), {3, 0, 0}));
            double friction = 0, normal = 0;
            for (int s = 0; s * dt < 0.25; ++s) {
                ASSERT_EQ(world.step(dt).failure, "");
                const Rub now = rub(world, 0);
                const double tolerance = 1e-4 * 9.81 * world.elastic(0).mass();  // of the solver
                EXPECT_LE(now.friction, 1.01 * mu * now.normal + tolerance)
                    << dt << ' ' << mu << " step " << s;
                const Eigen::Vector3d v = test::linear_momentum(world, 0) / world.elastic(0).mass();
                if (v[0] < 0.5) break;
                friction += now.friction;
                normal += now.normal;
            }
            ASSERT_GT(normal, 0);
            EXPECT_NEAR(friction / normal, mu, 0.025 * mu) << dt << ' ' << mu;
        }
}

TEST(Friction, OnTheFloorStaysWhereAWallLetsGo) {
    for (const double young : {1e5, 1e7, 1e9})
        for (const double dt : {1e-3, 5e-3, 2e-2}) {
            const Model box({0.2, 0.2, 0.2}, {2, 2, 2}, {.young = young});
            const double mu = 0.3;
            World world({});
            world.add_obstacle(test::floor_at(0, mu));
            // Presses the block against another wall, and leaves.
            world.add_obstacle(
                {.shape = PlaneShape{.point = {0, 0.1004, 0}, .normal = {0, -1, 0}}, .friction = 0});
            world.add_obstacle({.shape = PlaneShape{.point = {0, -0.1004, 0}, .normal = {0, 1, 0}},
                                .motion = travel({0, -0.2, 0}, 0.1, 1),
                                .friction = 0});
            world.add_body(box.at({0, 0, 0.1004}, Eigen::Matrix3d::Identity(), {3, 0, 0}));
            Eigen::Vector3d sum = Eigen::Vector3d::Zero();
            for (int s = 0; s * dt < 0.3; ++s) {
                ASSERT_EQ(world.step(dt).failure, "");
                if (s * dt < 0.05) continue;  // settles on the floor
                const Eigen::Vector3d force = world.contact_forces(0).colwise().sum();
                sum += force;
                // A block that vibrates faster than the steps rattles, and what stretches friction in one
                // step presses in another.
                if (2 * 0.2 / std::sqrt(young / 1000) < dt) continue;
                EXPECT_NEAR(-force[0], mu * force[2], 0.01 * mu * force[2]) << s << ' ' << young << ' ' << dt;
            }
            EXPECT_NEAR(-sum[0], mu * sum[2], 0.025 * mu * sum[2]) << young << ' ' << dt;
        }
}

TEST(Friction, OfTwoBodiesThatHitObliquelyIsNeverMoreThanItsShareOfTheNormalForce) {
    const Model box({0.2, 0.2, 0.2}, {2, 2, 2}, {.young = 1e7});
    const double mu = 0.1;
    WorldConfig config{.gravity = Eigen::Vector3d::Zero()};
    config.contact.friction = mu;
    World world(config);
    world.add_body(box.at({0, 0, 0}));
    world.add_body(box.at({0.02, 0, 0.22}, Eigen::Matrix3d::Identity(), {2, 0, -1}));
    double friction = 0, normal = 0;
    for (int s = 0; s < 40; ++s) {
        ASSERT_EQ(world.step(5e-3).failure, "");
        const Rub now = rub(world, 1);
        friction += now.friction;
        normal += now.normal;
    }
    ASSERT_GT(normal, 0);
    EXPECT_NEAR(friction / normal, mu, 0.25 * mu);  // the faces turn while they touch
}

/// Two blocks on each other on a slope, at nine tenths of what friction holds.
TEST(Friction, HoldsWithoutCreepAndFromASnapshotWithTheSameBits) {
    const Model box({0.2, 0.2, 0.05}, {2, 2, 1});
    const double angle = 0.35, mu = std::tan(angle) / 0.9;
    const auto build = [&] {
        WorldConfig config{.gravity = 9.81 * Eigen::Vector3d(std::sin(angle), 0, -std::cos(angle))};
        config.contact.friction = mu;
        auto world = std::make_unique<World>(config);
        world->add_obstacle(test::floor_at(0, mu));
        world->add_body(box.at({0, 0, 0.0253}));
        world->add_body(box.at({0.013, 0.007, 0.0758}));
        return world;
    };
    const auto world = build(), resumed = build();
    for (int s = 0; s < 200; ++s) ASSERT_EQ(world->step(1e-2).failure, "");
    const WorldSnapshot snapshot = world->snapshot();
    ASSERT_GT(snapshot.stretches.contacts.size(), 8u);
    const Eigen::Vector3d settled = test::centre_of_mass(*world, 1);
    resumed->restore(snapshot);
    for (int s = 0; s < 1000; ++s) {
        ASSERT_EQ(world->step(1e-2).failure, "");
        if (s < 20) resumed->step(1e-2);
        if (s != 19) continue;
        for (const int b : {0, 1}) EXPECT_TRUE(resumed->state(b).x == world->state(b).x);
    }
    EXPECT_LT((test::centre_of_mass(*world, 1) - settled).norm(), 1e-7);

    WorldSnapshot bad = snapshot;
    bad.stretches.contacts.back()[1] = 1'000'000;
    EXPECT_THROW(resumed->restore(bad), std::invalid_argument);
    bad = snapshot;
    bad.stretches.contacts.front()[3] = 2;
    EXPECT_THROW(resumed->restore(bad), std::invalid_argument);
    bad = snapshot;
    bad.stretches.ways.pop_back();
    EXPECT_THROW(resumed->restore(bad), std::invalid_argument);
}

// Steps within which a body comes to rest: sound crosses it many times.

/// A ball of radius R in a box of tetrahedra, around the origin.
WorldBody ball(double R, double young) {
    const shapes::Surface sphere = shapes::sphere(14, 16, 1);
    TetMesh box = test::box_mesh({2.2, 2.2, 2.2}, {4, 4, 4}, 0.1);
    box.X = ((box.X.rowwise() - Eigen::RowVector3d::Constant(1.1)) * R).eval();
    const Nodes points = R * sphere.X.cast<double>();
    WorldBody body;
    body.elastic = std::make_shared<const ElasticBody>(
        box, Material{.young = young, .poisson = 0.3, .rayleigh_mass = 0, .rayleigh_stiffness = 0});
    body.W = embed(box, points);
    body.F = sphere.F;
    return body;
}

TEST(LongSteps, ABallBetweenPlatesStaysAtRestAndResistsTheSameInEveryUnit) {
    std::vector<double> forces;
    for (const double R : {0.01, 1.0})
        for (const double young : {1e4, 1e9}) {
            WorldConfig config;
            config.gravity.setZero();
            World world(config);
            world.add_body(ball(R, young));
            const ElasticBody& elastic = world.elastic(0);
            const double dt = 20 * R / std::sqrt(young / elastic.material().density), start = 1.01 * R,
                         way = 0.03 * R;
            constexpr int steps = 40;
            for (const int side : {-1, 1})
                world.add_obstacle(
                    {.shape = PlaneShape{.point = {0, 0, side * start}, .normal = {0, 0, -1.0 * side}},
                     .motion = travel({0, 0, -side * way / (steps * dt)}, 0, steps * dt),
                     .friction = 0});
            for (int s = 0; s < steps + 20; ++s)
                ASSERT_EQ(world.step(dt).failure, "") << R << ' ' << young << ' ' << s;
            forces.push_back(world.contact_forces(0).col(2).cwiseAbs().sum() / (young * R * R));
            EXPECT_LT(world.state(0).v.rowwise().norm().maxCoeff() * dt, 1e-3 * R) << R << ' ' << young;
            EXPECT_GT(forces.back(), 0.01);
            EXPECT_NEAR(forces.back(), forces.front(), 5e-3 * forces.front()) << R << ' ' << young;
        }
}

TEST(LongSteps, ForcesOfContactBalanceTheMomentumOfAStiffCube) {
    for (const double dt : {1e-4, 1e-2}) {
        const test::Model cube({0.1, 0.1, 0.1}, {2, 2, 2}, {.young = 1e9, .rayleigh_mass = 0});
        World world({});
        world.add_body(cube.at({0, 0, 0.0505}, test::turned(0.01)));
        const double mass = world.elastic(0).mass();
        world.add_obstacle(test::floor_at(0));
        world.add_obstacle({.shape = PlaneShape{.point = {0, 0, 0.104}, .normal = {0, 0, -1}},
                            .motion = travel({0, 0, -0.004 / (40 * dt)}, 0, 40 * dt)});
        double most = 0;
        for (int s = 0; s < 60; ++s) {
            const Eigen::Vector3d before = test::linear_momentum(world, 0);
            ASSERT_EQ(world.step(dt).failure, "") << dt << ' ' << s;
            const Nodes& forces = world.contact_forces(0);
            const Eigen::Vector3d given =
                dt * (forces.colwise().sum().transpose() - mass * 9.81 * Eigen::Vector3d::UnitZ());
            const double pressing = dt * forces.rowwise().norm().sum();
            most = std::max(most, pressing);
            EXPECT_LT((test::linear_momentum(world, 0) - before - given).norm(), 1e-3 * most)
                << dt << ' ' << s;
        }
        EXPECT_GT(most, 10 * mass * 9.81 * dt);
    }
}

}  // namespace
}  // namespace nbd
