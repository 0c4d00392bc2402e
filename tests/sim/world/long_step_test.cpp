// Steps within which a body comes to rest: sound crosses it many times.
#include <gtest/gtest.h>

#include <cmath>

#include "meshing/body/embed.hpp"
#include "tests/sim/support/momentum.hpp"
#include "tests/sim/world/box_model.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/shapes.hpp"

namespace nbd {
namespace {

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
                     .velocity = {0, 0, -side * way / (steps * dt)},
                     .friction = 0,
                     .stop = steps * dt});
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
        const test::Model cube({0.1, 0.1, 0.1}, {2, 2, 2}, 1e9);
        World world({});
        world.add_body(cube.at({0, 0, 0.0505}, test::turned(0.01)));
        const double mass = world.elastic(0).mass();
        world.add_obstacle(test::floor_at(0));
        world.add_obstacle({.shape = PlaneShape{.point = {0, 0, 0.104}, .normal = {0, 0, -1}},
                            .velocity = {0, 0, -0.004 / (40 * dt)},
                            .stop = 40 * dt});
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
