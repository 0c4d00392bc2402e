// What is told from step to step: grips, motors, tensions, loads.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "meshing/body/rigid_body.hpp"
#include "sim/fem/momentum.hpp"
#include "sim/world/world.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/sim/support/momentum.hpp"
#include "tests/sim/world/box_model.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

using Eigen::Vector3d;
using test::Model;

constexpr double dt = 5e-3;

Model rigid_block() {
    TriMesh box = test::box(0.1, 0.1, 0.1, 1);
    box.X.array() -= 0.05;
    return Model(make_rigid_body("block", std::move(box), 1000), true);
}

WorldConfig without_gravity() { return {.gravity = Vector3d::Zero()}; }

Keyed<double> constant(double value) { return {{0.0}, {value}}; }

/// A controller that tells the angle at the end of each step does what keyframes of it do.
TEST(Targets, BringAMotorWhereKeyframesWould) {
    const Model block = rigid_block();
    const auto angle = [](double time) { return 0.8 * std::sin(5 * time); };
    const auto made = [&](const Keyed<double>& motor) {
        World world(without_gravity());
        world.add_body(block.at({0, 0, 0}));
        world.add_joint(
            {.name = "hinge",
             .a = 0,
             .b = -1,
             .kind = HingeJoint{.point = {0.2, 0, 0}, .axis = {0, 0, 1}, .angle = {.motor = motor}}});
        return world;
    };
    Keyed<double> keys;
    for (int step = 0; step <= 200; ++step) {
        keys.times.push_back(step * dt);
        keys.values.push_back(angle(step * dt));
    }
    World keyed = made(keys), told = made(constant(0));
    for (int step = 1; step <= 200; ++step) {
        told.set_joint(0, angle(step * dt));
        ASSERT_EQ(told.step(dt).failure, "");
        ASSERT_EQ(keyed.step(dt).failure, "");
        ASSERT_NEAR(told.joint_value(0), keyed.joint_value(0), 1e-9);
        ASSERT_NEAR(told.joint_value(0), angle(step * dt), 2e-2);
    }
    ASSERT_EQ(told.step(dt).failure, "") << "it stays where it was told";
    EXPECT_NEAR(told.joint_value(0), angle(1), 1e-2);
}

/// A region goes exactly where it is told, and two tellings of one step are the last of them.
TEST(Targets, MoveAGripExactly) {
    const Model block({0.4, 0.1, 0.1}, {4, 1, 1}, {.young = 1e5});
    World world(without_gravity());
    WorldBody body = block.at({0, 0, 0});
    Grip grip;
    for (int i = 0; i < body.state.x.rows(); ++i)
        if (body.state.x(i, 0) < -0.19) grip.nodes.push_back(i);
    body.grips = {grip};
    const Nodes begin = body.state.x(grip.nodes, Eigen::all);
    world.add_body(std::move(body));
    for (int step = 1; step <= 30; ++step) {
        const double t = step * dt;
        const Keyframe place{.translation = {0.1 * std::sin(9 * t), 0, t * t}, .rotation = {0.5 * t, 0, 0}};
        world.move_grip(0, 0, {.translation = {9, 9, 9}});
        world.move_grip(0, 0, place);
        ASSERT_EQ(world.step(dt).failure, "");
        const Placing told = Motion{.keyframes = {place}}.at(0);
        for (std::size_t k = 0; k < grip.nodes.size(); ++k)
            ASSERT_LT((world.state(0).x.row(grip.nodes[k]).transpose() - told(begin.row(k))).norm(), 1e-12);
    }
}

TEST(Targets, SetTensionsLoadsAndWinds) {
    const Model block = rigid_block();
    World world(without_gravity());
    WorldBody body = block.at({0, 0, 0});
    body.loads = {{.kind = LoadKind::wind, .air = {.density = 1000, .normal = 1, .tangential = 1}},
                  {.kind = LoadKind::force, .value = {0, 1, 0}}};
    world.add_body(std::move(body));
    world.add_body(block.at({0.5, 0, 0}));
    world.add_joint(
        {.name = "cord", .a = 1, .b = -1, .kind = CordJoint{.from = {0.5, 0, 0}, .to = {2, 0, 0}}});
    EXPECT_EQ(test::refusal([&] { world.set_joint(0, 1); }),
              "world: joint \"cord\" has no motor, winch or given tension");
    CordJoint pull{.from = {0.5, 0, 0}, .to = {0.5, 2, 0}};
    pull.tension = constant(0);
    world.add_joint({.name = "pull", .a = 1, .b = -1, .kind = pull});
    world.set_joint(1, 3);
    world.set_load(0, 1, 0);
    world.set_wind(0, 0, {0, 0, 2});
    for (int step = 0; step < 400; ++step) ASSERT_EQ(world.step(dt).failure, "");
    const Vector3d v = test::linear_momentum(world, 0) / world.elastic(0).mass();
    EXPECT_NEAR(v.z(), 2, 0.1);
    EXPECT_LT(std::abs(v.y()), 1e-3) << "the force was there for the time of one step alone";
    double pulled = 0;
    for (const Reaction& reaction : world.reactions())
        if (reaction.by == ReactionBy::joint && reaction.number == 1) pulled = reaction.force.norm();
    EXPECT_NEAR(pulled, 3, 1e-3);
}

/// Snapshots leave out what was told: a controller tells it again and goes on with the same bits.
TEST(Targets, GoOnFromASnapshotWhereTheyAreToldAgain) {
    const Model block = rigid_block();
    const auto made = [&] {
        World world(WorldConfig{});
        world.add_body(block.at({0, 0, 0}));
        HingeJoint hinge{.point = {0.2, 0, 0}, .axis = {0, 1, 0}, .angle = {}};
        hinge.angle.motor = constant(0);
        world.add_joint({.name = "hinge", .a = 0, .b = -1, .kind = hinge});
        return world;
    };
    const auto angle = [](int step) { return 0.2 * std::sin(0.1 * step); };
    World whole = made(), resumed = made();
    for (int step = 1; step <= 40; ++step) {
        if (step == 21) resumed.restore(whole.snapshot());
        for (World* world : {&whole, &resumed}) {
            if (world == &resumed && step < 21) continue;
            world->set_joint(0, angle(step));
            ASSERT_EQ(world->step(dt).failure, "");
        }
    }
    EXPECT_EQ(whole.state(0).x, resumed.state(0).x);
    EXPECT_EQ(whole.state(0).v, resumed.state(0).v);
}

TEST(Targets, AreForgottenWhereASnapshotIsRestored) {
    const Model block = rigid_block();
    World world(without_gravity());
    world.add_body(block.at({0, 0, 0}));
    HingeJoint hinge{.point = {0.2, 0, 0}, .axis = {0, 1, 0}, .angle = {}};
    hinge.angle.motor = constant(0);
    world.add_joint({.name = "hinge", .a = 0, .b = -1, .kind = hinge});
    const WorldSnapshot start = world.snapshot();
    world.set_joint(0, 0.5);
    world.restore(start);
    ASSERT_EQ(world.step(dt).failure, "");
    EXPECT_NEAR(world.joint_value(0), 0, 1e-9);
}

/// What was told to go stays where it was when it was told, in the steps after the snapshot, too.
TEST(Targets, OfObstaclesAndGripsAreForgottenWhereASnapshotIsRestored) {
    const Model block = rigid_block();
    World world(without_gravity());
    WorldBody body = block.at({0, 0, 0.06});
    body.grips = {{.nodes = {0, 1, 2, 3}}};
    world.add_body(std::move(body));
    world.add_obstacle({.shape = PlaneShape{}});
    ASSERT_EQ(world.step(dt).failure, "");
    const WorldSnapshot start = world.snapshot();
    const Nodes x = start.bodies[0].x;
    world.move_obstacle(0, {.translation = {0, 0, 2}});
    world.move_grip(0, 0, {.translation = {0, 0, 1}});
    world.restore(start);
    for (int step = 0; step < 20; ++step) ASSERT_EQ(world.step(dt).failure, "");
    EXPECT_LT((world.snapshot().bodies[0].x - x).norm(), 1e-9);
}

/// A grip and a floor that move by themselves go on as if nothing had been told.
TEST(Targets, LeaveMotionsAloneWhereTheyAreForgotten) {
    const Model block = rigid_block();
    World world(without_gravity());
    WorldBody body = block.at({0, 0, 0.06});
    body.grips = {{.nodes = {0, 1, 2, 3}, .motion = travel({0, 0, 0.1})}};
    world.add_body(std::move(body));
    world.add_obstacle({.shape = PlaneShape{}, .motion = travel({0, 0, 0.05})});
    const Nodes begin = world.state(0).x;
    for (int step = 0; step < 20; ++step) ASSERT_EQ(world.step(dt).failure, "");
    world.move_obstacle(0, {.translation = {0, 0, -2}});
    world.move_grip(0, 0, {.translation = {0, 0, 1}});
    world.restore(world.snapshot());
    for (int step = 0; step < 20; ++step) ASSERT_EQ(world.step(dt).failure, "");
    EXPECT_NEAR(world.state(0).x(0, 2) - begin(0, 2), 0.1 * 40 * dt, 1e-9);
    EXPECT_NEAR(world.obstacles()[0].motion.keyframe_at(world.time()).translation.z(), 0.05 * 40 * dt, 1e-9);
}

TEST(Targets, RefuseWhatIsNotThere) {
    const Model block = rigid_block();
    World world(without_gravity());
    WorldBody body = block.at({0, 0, 0});
    body.loads = {{.kind = LoadKind::force, .value = {0, 1, 0}}, {.kind = LoadKind::wind}};
    body.grips = {{.nodes = {0, 1, 2, 3}, .release = 0}};
    body.name = "a";
    world.add_body(std::move(body));
    HingeJoint free{.point = {0.2, 0, 0}};
    world.add_joint({.name = "free", .a = 0, .b = -1, .kind = free});
    EXPECT_EQ(test::refusal([&] { world.set_joint(0, 1); }),
              "world: joint \"free\" has no motor, winch or given tension");
    EXPECT_EQ(test::refusal([&] { world.set_joint(1, 1); }), "world: joint 1 is not one of its 1");
    EXPECT_EQ(test::refusal([&] { world.set_load(0, 2, 1); }), "world: load 2 of a is not there");
    EXPECT_EQ(test::refusal([&] { world.set_load(0, 1, 1); }),
              "world: load 1 of a is a wind, which has a velocity");
    EXPECT_EQ(test::refusal([&] { world.set_load(0, 0, NAN); }), "world: the factor of a load is not finite");
    EXPECT_EQ(test::refusal([&] { world.set_wind(0, 0, {0, 0, 1}); }), "world: load 0 of a is no wind");
    EXPECT_EQ(test::refusal([&] { world.move_grip(0, 1, {}); }), "world: grip 1 is not one of the 1 of a");
    EXPECT_EQ(test::refusal([&] { world.move_grip(0, 0, {.scale = 2}); }),
              "world: a rigid body cannot be scaled");
    CordJoint pull{.from = {0, 0, 0}, .to = {0, 2, 0}};
    pull.tension = constant(0);
    world.add_joint({.name = "pull", .a = 0, .b = -1, .kind = pull});
    EXPECT_EQ(test::refusal([&] { world.set_joint(1, -1); }),
              "world: the tension of joint \"pull\" is -1, but must be >= 0");
}

}  // namespace
}  // namespace nbd
