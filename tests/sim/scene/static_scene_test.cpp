// Scenes whose bodies come to balance instead of moving.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <span>
#include <string>

#include "sim/scene/scene.hpp"
#include "tests/sim/scene/scene_text.hpp"
#include "tests/support/box_body.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

using test::complaint;
using test::with;

const std::string static_time = R"("time": {"static": {"increments": 4, "tolerance": 1e-5}})";

TEST(StaticScene, FramesAreIncrements) {
    const SceneSpec spec = parse_scene(with("", static_time), "");
    ASSERT_TRUE(spec.time.statics);
    EXPECT_EQ(spec.time.statics->tolerance, 1e-5);
    EXPECT_EQ(spec.time.frames, 4);
    EXPECT_EQ(spec.time.steps_per_frame, 1);
    EXPECT_EQ(spec.time.dt, 0.25);
    EXPECT_EQ(parse_scene(with("", R"("time": {"static": {}})"), "").time.frames, 10);
    EXPECT_FALSE(parse_scene(with(""), "").time.statics);
}

TEST(StaticScene, RefusesWrongNumbers) {
    const auto with_static = [](const std::string& keys) {
        return complaint(with("", R"("time": {"static": {)" + keys + "}}"));
    };
    EXPECT_EQ(with_static(R"("increments": 0)"),
              "time.static.increments: is 0, but must be between 1 and 10000");
    EXPECT_EQ(with_static(R"("tolerance": 0.5)"),
              "time.static.tolerance: is 0.5, but must be between 1e-10 and 0.1");
    EXPECT_THAT(with_static(R"("steps": 3)"), testing::HasSubstr("time.static: unknown key \"steps\""));
    EXPECT_THAT(complaint(with("", R"("time": {"static": 3})")), testing::HasSubstr("time.static: must be"));
}

TEST(StaticScene, RefusesKeysOfMotion) {
    for (const char* key : {"dt", "frames", "steps_per_frame"})
        EXPECT_EQ(
            complaint(with("", R"("time": {"static": {}, ")" + std::string(key) + "\": 1}")),
            "time." + std::string(key) + ": must not be beside \"static\", whose increments are the frames");
    const std::string no_sense = ": has no sense in a static scene: ";
    const auto in_body = [](const std::string& keys) { return complaint(with(keys, static_time)); };
    EXPECT_EQ(in_body(R"("velocity": [0, 0, 1])"),
              "bodies[0].velocity" + no_sense + "bodies have no velocities");
    EXPECT_EQ(in_body(R"("angular_velocity": [0, 0, 1])"),
              "bodies[0].angular_velocity" + no_sense + "bodies have no velocities");
    for (const char* key : {"rayleigh_mass", "rayleigh_stiffness"})
        EXPECT_EQ(in_body(R"("material": {")" + std::string(key) + "\": 0.1}"),
                  "bodies[0].material." + std::string(key) + no_sense + "nothing is damped");
    const auto beside = [](const std::string& keys) {
        return complaint(with("", keys + ", " + static_time));
    };
    EXPECT_EQ(beside(R"("joints": [{"body": "a", "ball": {"point": [0, 0, 0]}, "strength": 3}])"),
              "joints[0].strength" + no_sense + "joints do not break");
    EXPECT_EQ(beside(R"("joints": [{"body": "a", "spring": {"from": [0, 0, 0], "to": [0, 0, 1],
                                                            "stiffness": 3, "damping": 1}}])"),
              "joints[0].spring.damping" + no_sense + "nothing is damped");
    EXPECT_EQ(beside(R"("joints": [{"body": "a", "hinge": {"point": [0, 0, 0], "damping": 1}}])"),
              "joints[0].hinge.damping" + no_sense + "nothing is damped");
    EXPECT_EQ(beside(R"("solver": {"integrator": "backward_euler"})"),
              "solver.integrator" + no_sense + "there are no steps in time");
    EXPECT_EQ(beside(R"("solver": {"tangent": "full"})"),
              "solver.tangent" + no_sense + "increments choose it");
    EXPECT_EQ(beside(R"("solver": {"newton_tolerance": 1e-3})"),
              "solver.newton_tolerance" + no_sense + "\"time.static.tolerance\" is its tolerance");
    EXPECT_EQ(beside(R"("solver": {"newton_iterations": 5000, "max_substeps": 2})"), "");
    EXPECT_EQ(beside(R"("gravity": [{"time": 0, "value": [0, 0, 0]}, {"time": 2, "value": [0, 0, -9]}])"),
              "gravity: goes on until 2, but a static scene ends at 1, its whole load");
    EXPECT_EQ(beside(R"("joints": [{"body": "a", "hinge": {"point": [0, 0, 0],
                                                            "motor": [[0, 0], [1.5, 20]]}}])"),
              "joints[0].hinge.motor: goes on until 1.5, but a static scene ends at 1, its whole load");
}

World built_from(const std::string& scene) {
    const LoadedBody loaded{
        std::make_shared<const Body>(test::box_body({1, 0.4, 0.3}, {4, 2, 2}, {.young = 1e6})), nullptr};
    return build_world(parse_scene(scene, ""), std::span(&loaded, 1));
}

/// Far from the origin, too, and with gravity by keyframes.
TEST(StaticScene, ComesToBalance) {
    for (const bool is_far : {false, true})
        for (const bool by_keys : {false, true}) {
            const std::string at = is_far ? "1e5" : "0";
            World world = built_from(with(
                R"("transform": {"translate": [)" + at + R"(, 0, 0]}, "pins": [{"box": {"min": [)" +
                    std::to_string((is_far ? 1e5 : 0) - 0.51) + R"(, -1, -1], "max": [)" +
                    std::to_string((is_far ? 1e5 : 0) - 0.49) + R"(, 1, 1]}}])",
                (by_keys
                     ? R"("gravity": [{"time": 0, "value": [0, 0, -3]}, {"time": 1, "value": [0, 0, -9]}], )"
                     : R"("gravity": [0, 0, -9], )") +
                    static_time));
            const double weight = 9 * world.elastic(0).mass();
            for (const double share : {0.25, 0.5, 0.75, 1.0}) {
                const WorldReport report = world.step(0.25);
                ASSERT_EQ(report.failure, "");
                EXPECT_LE(report.imbalance, 1e-5);
                const double now = by_keys ? (1 + 2 * share) / 3 : share;
                EXPECT_NEAR(world.reactions().at(0).force.z(), now * weight, 1e-4 * weight);
                EXPECT_EQ(world.state(0).v.cwiseAbs().maxCoeff(), 0);
            }
        }
}

TEST(StaticScene, NamesWhatNothingHolds) {
    World world = built_from(with("", static_time));
    EXPECT_EQ(world.step(0.25).failure,
              "at 0.25 of the load: nothing holds bodies[0] (a), which moves on and on without a balance");
    EXPECT_EQ(world.time(), 0);
}

}  // namespace
}  // namespace nbd
