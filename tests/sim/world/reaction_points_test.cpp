// Where reactions act.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <vector>

#include "meshing/body/rigid_body.hpp"
#include "sim/world/world.hpp"
#include "tests/sim/world/box_model.hpp"
#include "tests/support/box_body.hpp"

namespace nbd {
namespace {

using Eigen::Vector3d;
using test::Model;

constexpr double gravity_of_board = 9.81;

Reaction only_reaction(const World& world) {
    const std::vector<Reaction> all = world.reactions();
    EXPECT_EQ(all.size(), 1u);
    return all.empty() ? Reaction{} : all[0];
}

/// A rigid board on a floor, pressed by a force at a place.
Reaction of_a_pressed_board(const WorldConfig& config, const Vector3d& place, double force, double step,
                            double* weight) {
    const Body board = make_rigid_body("board", test::box_body({0.4, 0.3, 0.05}, {8, 6, 1}).surface, 1000);
    World world(config);
    WorldBody body = Model(board).at({0, 0, 0.0251});
    world.add_body(std::move(body));
    world.add_obstacle(test::floor_at(0));
    *weight = gravity_of_board * world.elastic(0).mass();
    // The force at a place of an affine body, by the barycentric coordinates of the place in its tetrahedron.
    Eigen::Matrix4d corners = Eigen::Matrix4d::Ones();
    corners.topRows<3>() = world.elastic(0).rest().X.transpose();
    const Eigen::Vector4d shares = corners.inverse() * Eigen::Vector4d(place.x(), place.y(), place.z(), 1);
    for (int k = 0; k < 4; ++k) world.forces(0).row(k) << 0, 0, -shares[k] * force;
    for (int i = 0; i < 200; ++i) EXPECT_EQ(world.step(step).failure, "") << i;
    return only_reaction(world);
}

TEST(ReactionPoint, OfAPressedBoardIsWhereLeversBalance) {
    for (const double step : {0.01, 0.004})
        for (const Vector3d& place : {Vector3d(0.1, 0, 0), Vector3d(0.05, -0.08, 0.02)}) {
            double weight = 0;
            const double force = 40;
            const Reaction floor = of_a_pressed_board(
                {.step = {.integrator = TimeIntegrator::backward_euler}}, place, force, step, &weight);
            EXPECT_EQ(floor.by, ReactionBy::obstacle);
            EXPECT_NEAR(floor.force.z(), weight + force, 1e-3 * weight);
            const double share = force / (weight + force);
            EXPECT_NEAR(floor.point.x(), share * place.x(), 1e-3);
            EXPECT_NEAR(floor.point.y(), share * place.y(), 1e-3);
            EXPECT_NEAR(floor.point.z(), 0, 1e-3) << "on the floor";
            const Vector3d about_it = floor.torque - floor.point.cross(floor.force);
            EXPECT_LT(about_it.head<2>().norm(), 2e-2 * force * place.norm()) << "no lever is left there";
        }
}

TEST(ReactionPoint, OfAGripIsAmongItsNodesInTheScenesCoordinates) {
    const Model model({0.4, 0.1, 0.1}, {8, 2, 2}, {.young = 1e6});
    const Vector3d origin(100, -50, 7);
    World world({.origin = origin});
    WorldBody body = model.at({0, 0, 0});
    Grip grip;
    for (int i = 0; i < body.state.x.rows(); ++i)
        if (body.state.x(i, 0) < -0.199) grip.nodes.push_back(i);
    ASSERT_EQ(grip.nodes.size(), 9u);
    body.grips = {grip};
    world.add_body(std::move(body));
    for (int i = 0; i < 5; ++i) ASSERT_EQ(world.step(0.01).failure, "");
    const Reaction wall = only_reaction(world);
    const Vector3d local = wall.point - origin;
    EXPECT_NEAR(local.x(), -0.2, 1e-12);
    EXPECT_NEAR(local.y(), 0, 0.005) << "by symmetry, but for the diagonals of cells";
    EXPECT_LE(std::abs(local.z()), 0.05);
    // A force at the wall and a moment that carries the lever of the weight.
    EXPECT_GT((wall.torque - wall.point.cross(wall.force)).norm(), 0.01 * wall.force.norm());
}

TEST(ReactionPoint, OfABallJointIsTheJoint) {
    const Model model({0.2, 0.1, 0.1}, {2, 1, 1}, {.young = 1e6});
    World world({});
    world.add_body(model.at({0, 0, 0}));
    const Vector3d point(0.1, 0.02, 0.01);
    Joint joint;
    joint.name = "ball";
    joint.a = 0;
    joint.kind = BallJoint{.point = point};
    world.add_joint(joint);
    ASSERT_EQ(world.step(0.001).failure, "");
    const Reaction told = only_reaction(world);
    EXPECT_EQ(told.by, ReactionBy::joint);
    EXPECT_LT((told.point - point).norm(), 1e-4);
}

}  // namespace
}  // namespace nbd
