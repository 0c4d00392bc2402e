// Static increments of bodies that have far to go, or are hardly held.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <utility>

#include "meshing/body/rigid_body.hpp"
#include "sim/world/world.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/sim/world/box_model.hpp"
#include "tests/sim/world/static_world.hpp"

namespace nbd {
namespace {

using test::Model;

/// A grip takes its nodes all of its way, by several sizes of the body in one increment.
TEST(FarStatics, AGripComesToItsEnd) {
    for (const double size : {0.01, 1.0, 100.0})
        for (const int increments : {1, 10}) {
            const Model bar({size, 0.1 * size, 0.1 * size}, {4, 1, 1}, {.young = 1e6, .poisson = 0});
            WorldBody body = bar.at({0, 0, 0});
            const auto at = [&](double x) {
                return test::nodes_where(bar.body.tets.X,
                                         [&](const auto& p) { return std::abs(p[0] - x) < 1e-6 * size; });
            };
            body.grips.push_back({.nodes = at(-size / 2)});
            Grip pull{.nodes = at(size / 2)};
            pull.motion.keyframes = {{.time = 0, .to_next = Interpolation::linear},
                                     {.time = 1, .translation = {3 * size, 0, 0}}};
            body.grips.push_back(pull);
            World world(test::static_config({0, 0, 0}));
            world.add_body(body);
            const WorldReport report = test::load_up(world, increments);
            ASSERT_EQ(report.failure, "") << size << ' ' << increments;
            EXPECT_NEAR(world.state(0).x(pull.nodes.front(), 0), 3.5 * size, 1e-9 * size);
            const double force = 3 * 1e6 * 0.01 * size * size;  // of a law that is linear in the stretch
            EXPECT_NEAR(test::force_by(world, 0, ReactionBy::grip, 1).x() / force, 1, 1e-5)
                << size << ' ' << increments;
        }
}

/// A cube that one node holds swings until its centre is below that, whatever the tolerance.
TEST(FarStatics, ACubeSwingsBelowTheNodeThatHoldsIt) {
    for (const double young : {1e5, 1e6})
        for (const double tolerance : {1e-4, 1e-5, 1e-6, 1e-7, 1e-8}) {
            const Model cube({0.1, 0.1, 0.1}, {2, 2, 2}, {.young = young});
            WorldBody body = cube.at({0, 0, 0});
            const Nodes& X = cube.body.tets.X;
            body.grips.push_back({.nodes = {0}});
            World world(test::static_config({0, 0, -9.81}, tolerance));
            world.add_body(body);
            const WorldReport report = test::load_up(world, 1);
            ASSERT_EQ(report.failure, "") << young << ' ' << tolerance;
            EXPECT_LE(report.imbalance, tolerance);
            const Eigen::Vector3d arm =
                centre_of_mass(*cube.elastic, world.state(0).x) - X.row(0).transpose();
            EXPECT_LT(arm.head<2>().norm(), 0.002 + 10 * tolerance) << young << ' ' << tolerance;
            EXPECT_LT(arm.z(), 0);
        }
}

/// What a body comes to rest on or hangs by may be many of its sizes away.
TEST(FarStatics, ABodyFallsUntilSomethingHoldsIt) {
    for (const double size : {0.01, 1.0}) {
        World world(test::static_config());
        const Model cube({size, size, size}, {2, 2, 2}, {.young = 1e7 * size});
        world.add_body(cube.at({0, 0, 20 * size}));
        world.add_obstacle({.shape = PlaneShape{}});
        const WorldReport report = test::load_up(world, 1);
        ASSERT_EQ(report.failure, "") << size;
        EXPECT_NEAR(world.state(0).x.col(2).minCoeff() / size, 0, 0.02);
    }
    for (const double size : {0.01, 1.0}) {
        TriMesh box = test::box(size, size, size, 2);
        box.X.array() -= size / 2;
        const Model weight(make_rigid_body("weight", std::move(box), 700), true);
        World world(test::static_config());
        world.add_body(weight.at({0, 0, 0}));
        const double rope = 30 * size;
        world.add_joint(
            {.kind = CordJoint{
                 .from = {0, 0, size / 2}, .to = {0, 0, size}, .length = rope, .pulls_only = true}});
        ASSERT_EQ(test::load_up(world, 1).failure, "") << size;
        EXPECT_NEAR(centre_of_mass(*weight.elastic, world.state(0).x).z(), size - rope - size / 2,
                    0.1 * size);
    }
}

}  // namespace
}  // namespace nbd
