// Prescribed velocities and winds in scenes.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "meshing/body/rigid_body.hpp"
#include "sim/fem/momentum.hpp"
#include "sim/scene/reaction_name.hpp"
#include "sim/scene/scene.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/sim/scene/scene_text.hpp"
#include "tests/support/box_body.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

using Eigen::Vector3d;
using test::complaint;
using test::with;

std::string gripped(const std::string& keys) {
    return with(R"("grips": [{"region": {"box": {"min": [-9, -9, -9], "max": [9, 9, 9]}}, )" + keys + "}]");
}

Motion motion_of(const std::string& keys) {
    return parse_scene(gripped(keys), "").bodies[0].grips[0].grip.motion;
}

/// p, moved at v and turned at w about c, which goes along.
Vector3d carried(const Vector3d& p, const Vector3d& c, const Vector3d& v, const Vector3d& w, double t) {
    const double angle = w.norm() * t;
    const Vector3d axis = angle == 0 ? Vector3d(0, 0, 1) : Vector3d(w.normalized());
    return c + Eigen::AngleAxisd(angle, axis) * (p - c) + t * v;
}

TEST(ToldVelocity, LeadsAlongTheHelixThatItSays) {
    const Vector3d v(0.1, -0.3, 2), w(0, 0, 4), c(1, 2, 3), p(1.5, 2, 2);
    const std::string rates = R"("velocity": [0.1, -0.3, 2], "angular_velocity": [0, 0, 4])";
    for (const std::string& form :
         {R"("centre": [1, 2, 3], "start": 0.5, "stop": 3, )" + rates,
          R"("centre": [1, 2, 3], "motion": [{"time": 0.5, )" + rates + R"(}, {"time": 3}])"}) {
        const Motion motion = motion_of(form);
        for (const double time : {0.0, 0.5, 0.7, 1.9, 3.0, 50.0}) {
            const double t = std::clamp(time - 0.5, 0.0, 2.5);
            EXPECT_LT((motion.at(time)(p) - carried(p, c, v, w, t)).norm(), 1e-13) << form << time;
        }
    }
    const Motion endless = motion_of(R"("centre": [1, 2, 3], "motion": [{"time": 0.5, )" + rates + "}]");
    for (const double time : {0.6, 10.0, 1000.0})
        EXPECT_LT((endless.at(time)(p) - carried(p, c, v, w, time - 0.5)).norm(), 1e-15 * time * 10);
}

TEST(ToldVelocity, GoesFromKeyframeToKeyframe) {
    const Motion motion = motion_of(
        R"("motion": [{"time": 1, "velocity": [1, 0, 0]}, {"time": 2, "velocity": [0, -2, 0]},
                      {"time": 4, "interpolation": "linear"}, {"time": 5, "translate": [0, 0, 0]}])");
    const auto at = [&](double time) { return motion.at(time).translation; };
    EXPECT_EQ(at(0.5), Vector3d(0, 0, 0));
    EXPECT_EQ(at(1.5), Vector3d(0.5, 0, 0));
    EXPECT_EQ(at(3), Vector3d(1, -2, 0));
    EXPECT_EQ(at(4), Vector3d(1, -4, 0));
    EXPECT_EQ(at(4.5), Vector3d(0.5, -2, 0));
    EXPECT_EQ(at(9), Vector3d(0, 0, 0));
}

TEST(ToldVelocity, MovesObstaclesToo) {
    const SceneSpec spec = parse_scene(
        with(
            "",
            R"("obstacles": [{"plane": {}, "centre": [1, 0, 0], "angular_velocity": [0, 3, 0], "stop": 2}])"),
        "");
    const Placing placing = spec.obstacles[0].obstacle.motion.at(0.5);
    EXPECT_LT((placing({2, 0, 0}) - carried({2, 0, 0}, {1, 0, 0}, Vector3d::Zero(), {0, 3, 0}, 0.5)).norm(),
              1e-14);
}

World built(const std::string& scene, const LoadedBody& loaded) {
    return build_world(parse_scene(scene, ""), std::span(&loaded, 1));
}

/// All of its nodes go as told, from a world far from the origin, too; reactions hold its weight and bend its
/// path: m (g + w^2 r).
TEST(ToldVelocity, MovesARigidBodyExactlyAndTellsWhatThatTakes) {
    TriMesh box = test::box(0.2, 0.1, 0.1, 1);
    const LoadedBody loaded{std::make_shared<const Body>(make_rigid_body("box", std::move(box), 1000)),
                            nullptr};
    for (const double dt : {2e-3, 1e-2})
        for (const bool is_far : {false, true}) {
            const std::string place = is_far ? "1e6" : "0", centre = is_far ? "1000000.5" : "0.5",
                              far = is_far ? "1e9" : "9";
            World world =
                built(R"({"bodies": [{"body": "a.h5", "transform": {"translate": [)" + place +
                          R"(, 0, 0]}, "grips": [{"region": {"box": {"min": [-9, -9, -9], "max": [)" + far +
                          R"(, 9, 9]}}, "centre": [)" + centre +
                          R"(, 0.05, 0.05], "velocity": [0, 0, 0.5], "angular_velocity": [0, 0, 3]}]}]})",
                      loaded);
            EXPECT_EQ(world.origin().x() > 1, is_far);
            const Nodes begin = world.state(0).x;
            const Vector3d c = Vector3d(is_far ? 1000000.5 : 0.5, 0.05, 0.05) - world.origin();
            const double mass = world.elastic(0).mass();
            for (int step = 1; step <= 20; ++step) {
                ASSERT_EQ(world.step(dt).failure, "");
                for (int i = 0; i < 4; ++i)
                    ASSERT_LT((world.state(0).x.row(i).transpose() -
                               carried(begin.row(i), c, {0, 0, 0.5}, {0, 0, 3}, step * dt))
                                  .norm(),
                              1e-12 * (1 + c.norm()));
            }
            // At the middle of the step, or near it, as forces of a second order rule are.
            const Vector3d centre_now = centre_of_mass(world.elastic(0), world.state(0).x);
            Vector3d expected = 9 * mass * (c - centre_now);
            expected.z() = mass * 9.81;
            ASSERT_EQ(world.reactions().size(), 1u);
            const Vector3d force = world.reactions()[0].force;
            EXPECT_LT((force - expected).norm(), 3 * 2 * dt * expected.norm());
            EXPECT_NEAR(force.z(), mass * 9.81, 1e-6 * mass * 9.81);
        }
}

TEST(ToldVelocity, IsRefusedWhereItHasNoMeaning) {
    const std::string grip = "bodies[0].grips[0]";
    EXPECT_EQ(complaint(gripped(R"("velocity": [1, 0])")).find(grip + ".velocity: "), 0u);
    EXPECT_EQ(complaint(gripped(R"("velocity": [1, 0, 0], "translate": [1, 0, 0])")),
              grip + ".translate: must not be beside a velocity");
    EXPECT_EQ(complaint(gripped(R"("velocity": [1, 0, 0], "duration": 2)")),
              grip + ".duration: must not be beside a velocity");
    EXPECT_EQ(complaint(gripped(R"("translate": [1, 0, 0], "stop": 2)")), grip + ".stop: needs a velocity");
    EXPECT_EQ(complaint(gripped(R"("velocity": [1, 0, 0], "start": 2, "stop": 1)")),
              grip + R"(.stop: must not be before "start")");
    EXPECT_EQ(complaint(gripped(R"("velocity": [1, 0, 0], "take": 2, "start": 1)")),
              grip + R"(.start: must not be before "take")");
    EXPECT_EQ(complaint(gripped(R"("angular_velocity": [1, 0, 0], "motion": [{"time": 1}])")),
              grip + R"(.angular_velocity: must not be beside "motion", whose keyframes say it)");
    EXPECT_EQ(complaint(gripped(R"("take": 2, "motion": [{"time": 1, "velocity": [1, 0, 0]}])")),
              grip + R"(.motion[0].time: is 1, but a keyframe with a velocity must not be before "take", 2)");
    EXPECT_EQ(
        complaint(gripped(
            R"("motion": [{"time": 1, "velocity": [1, 0, 0]}, {"time": 2, "translate": [0, 0, 0]}])")),
        grip + ".motion[1].translate: must not follow a keyframe with a velocity, which says where it leads");
    EXPECT_EQ(
        complaint(gripped(
            R"("motion": [{"time": 1, "angular_velocity": [1, 0, 0]}, {"time": 2, "rotate": {"degrees": 1}}])")),
        grip + ".motion[1].rotate: must not follow a keyframe with a velocity, which says where it leads");
    EXPECT_EQ(
        complaint(gripped(R"("motion": [{"time": 1, "velocity": [1, 0, 0], "interpolation": "smooth"}])")),
        grip + ".motion[0].interpolation: must not be beside a velocity, by which it goes on evenly");
    EXPECT_EQ(
        complaint(
            gripped(R"("motion": [{"time": 1, "rotate": {"degrees": 90}, "angular_velocity": [1, 0, 0]}])")),
        grip +
            ".motion[0].angular_velocity: turns about another axis than the rotation so far; allowed: about "
            "the same, or keyframes with \"rotate\"");
}

TEST(SceneWind, BlowsOnThePartInItsRegionByKeyframes) {
    const LoadedBody loaded{std::make_shared<const Body>(test::box_body({1, 1, 1}, {2, 2, 2})), nullptr};
    const auto scene = [](const std::string& load) {
        return R"({"gravity": [0, 0, 0], "bodies": [{"body": "a.h5", "material": {"rayleigh_mass": 0},
                   "pins": [{"box": {"min": [-1, -1, -1], "max": [1, 1, -0.4]}}],
                   "loads": [{"force": [0, 0, 0]}, )" +
               load + R"(]}], "solver": {"integrator": "backward_euler"}})";
    };
    for (const bool is_part : {false, true}) {
        const std::string region =
            is_part ? R"(, "region": {"box": {"min": [-1, -1, 0.4], "max": [0.1, 1, 1]}})" : "";
        const std::string text = scene(R"({"wind": {"velocity": [{"time": 0, "value": [0, 0, 0]},
                                           {"time": 10, "value": [0, 0, -10]}], "density": 2})" +
                                       region + "}");
        World world = built(text, loaded);
        for (int step = 0; step < 5; ++step) ASSERT_EQ(world.step(1).failure, "");
        const std::vector<Reaction> reactions = world.reactions();
        ASSERT_EQ(reactions.size(), 2u);
        EXPECT_EQ(reactions[1].by, ReactionBy::wind);
        EXPECT_EQ(reactions[1].number, 1);
        EXPECT_NEAR(reactions[1].force.z(), -25 * (is_part ? 0.5 : 1), 0.02);
        EXPECT_EQ(reaction_name(parse_scene(text, ""), reactions[1]), "loads[1]");
        EXPECT_STREQ(name(reactions[1].by), "wind");
    }
    EXPECT_EQ(test::error_of([&] {
                  built(scene(R"({"wind": {"velocity": [0, 0, 1]}, "region": {"sphere": {"radius": 0.1}}})"),
                        loaded);
              }),
              "bodies[0] (a): loads[1]: the region holds no face of the body's surface");
}

TEST(SceneWind, IsRefusedWhereItHasNoMeaning) {
    const auto refused = [](const std::string& load) {
        return complaint(with(R"("loads": [)" + load + "]"));
    };
    const std::string at = "bodies[0].loads[0]";
    EXPECT_EQ(refused(R"({"wind": {}})"), at + ".wind.velocity: is missing");
    EXPECT_EQ(refused(R"({"wind": {"velocity": [0, 0, 0], "density": -1}})"),
              at + ".wind.density: is -1, but must be between 0 and 1e30");
    EXPECT_EQ(refused(R"({"wind": {"velocity": [0, 0, 0], "normal": -1}})"),
              at + ".wind.normal: is -1, but must be between 0 and 1e30");
    EXPECT_EQ(refused(R"({"wind": {"velocity": [0, 0, 0]}, "factor": [[0, 1]]})"),
              at + R"(.factor: is not for a wind, whose "velocity" takes keyframes)");
    EXPECT_EQ(refused(R"({"wind": {"velocity": [0, 0, 0]}, "cavity": 0})"),
              at + ".cavity: is for a pressure or a gas");
    EXPECT_EQ(refused(R"({"wind": {"velocity": [{"time": 1, "value": [0, 0, 0]},
                                                {"time": 1, "value": [0, 0, 1]}]}})"),
              at + ".wind.velocity[1].time: is 1, but must be later than 1 s, of the key before");
    EXPECT_EQ(refused(R"({"wind": {"velocity": [0, 0, 0], "drag": 1}})"),
              at + R"(.wind: unknown key "drag")");
}

/// A tendon over two points of the world holds a block by its weight: what lies between these is of its
/// length.
TEST(SceneWinch, HoldsABlockByATendonAndByARope) {
    TriMesh box = test::box(0.1, 0.1, 0.1, 1);
    const LoadedBody loaded{std::make_shared<const Body>(make_rigid_body("box", std::move(box), 1000)),
                            nullptr};
    for (const bool is_far : {false, true})
        for (const bool is_rope : {false, true}) {
            const std::string x = is_far ? "1000000.05" : "0.05", place = is_far ? "1e6" : "0";
            const std::string cord =
                is_rope
                    ? R"("joints": [{"name": "cord", "body": "a", "rope": {"from": [)" + x +
                          R"(, 0.05, 0.1], "to": [)" + x + R"(, 0.05, 1.1], "winch": [[0, 1], [1, 0.5]]}}])"
                    : R"("tendons": [{"name": "cord", "through": [{"body": "a", "at": [)" + x +
                          R"(, 0.05, 0.1]}, {"at": [)" + x + R"(, 0.05, 1.1]}, {"at": [)" + x +
                          R"(, 2.05, 1.1]}], "winch": [[0, 3], [1, 2.5]]}])";
            World world = built(R"({"bodies": [{"body": "a.h5", "name": "a", "transform": {"translate": [)" +
                                    place + ", 0, 0]}}], " + cord + "}",
                                loaded);
            while (world.time() < 2) ASSERT_EQ(world.step(5e-3).failure, "");
            EXPECT_NEAR(world.joint_value(0), 0.5, 1e-3);
            ASSERT_EQ(world.reactions().size(), 1u);
            EXPECT_NEAR(world.reactions()[0].force.z(), 9.81, 0.05);
        }
}

TEST(SceneWinch, IsRefusedWhereItHasNoMeaning) {
    const auto of_tendon = [](const std::string& keys, const std::string& more = "") {
        return complaint(with(R"("name": "a")", R"("tendons": [{"through": [{"body": "a", "at": [0, 0, 0]},
                                                  {"at": [0, 0, 1]}], )" +
                                                    keys + "}]" + more));
    };
    EXPECT_EQ(of_tendon(R"("winch": [[0, 1], [1, 0]])"), "tendons[0].winch: needs lengths above 0");
    EXPECT_EQ(of_tendon(R"("winch": [[1, 1], [0, 1]])"),
              "tendons[0].winch: its times must increase, but 0 s follows 1 s");
    EXPECT_EQ(of_tendon(R"("winch": [[0, 1]], "factor": [[0, 1]])"),
              "tendons[0].factor: is of a force, and this tendon has a length");
    EXPECT_EQ(of_tendon(R"("force": 1, "stiffness": 5)"),
              R"(tendons[0].stiffness: is for a tendon with a "winch")");
    EXPECT_EQ(of_tendon(R"("force": 1, "winch": [[0, 1]])").find("tendons[0]: needs exactly one of"), 0u);
    EXPECT_EQ(of_tendon(R"("stiffness": 1)").find("tendons[0]: needs exactly one of"), 0u);
    EXPECT_EQ(of_tendon(R"("winch": [[0, 1]])", R"(, "time": {"static": {}})").find("tendons[0].winch: "),
              0u);
    const auto of_rope = [](const std::string& keys) {
        return complaint(with(R"("name": "a")", R"("joints": [{"body": "a", "rope": {"from": [0, 0, 0],
                                                  "to": [0, 0, 1], )" +
                                                    keys + "}}]"));
    };
    EXPECT_EQ(of_rope(R"("winch": [[0, 0]])"), "joints[0].rope.winch: needs lengths above 0");
    EXPECT_EQ(of_rope(R"("winch": [[0, 1]], "length": 1)"),
              R"(joints[0].rope.winch: must not be beside "length")");
}

}  // namespace
}  // namespace nbd
