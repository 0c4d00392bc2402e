// Rules for pairs, loads and gravity in scenes.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sim/scene/scene.hpp"
#include "sim/scene/scene_check.hpp"
#include "tests/sim/scene/scene_text.hpp"
#include "tests/support/box_body.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

using test::complaint;
using test::with;

LoadedBody loaded_bar() {
    return {std::make_shared<const Body>(test::box_body({1, 0.4, 0.3}, {4, 2, 2})), nullptr};
}

World built_from(const std::string& scene, const LoadedBody& loaded) {
    return build_world(parse_scene(scene, ""), std::span(&loaded, 1));
}

TEST(Scene, RefusesRulesForPairsThatAreWrong) {
    const auto with_pair = [](const std::string& pair, const std::string& more = "") {
        return complaint(R"({"bodies": [{"body": "a.h5"}, {"body": "b.h5"}, {"body": "b.h5"}],
                             "obstacles": [{"sphere": {"radius": 1}}], "contact": {"pairs": [)" +
                         pair + more + "]}}");
    };
    const auto wrong = [](const std::string& what) { return "contact.pairs[0]" + what; };
    EXPECT_EQ(with_pair(R"({"bodies": ["a", "a"], "meet": false})"), "");
    EXPECT_EQ(with_pair(R"({"bodies": ["a", "aa"], "friction": 0})"),
              wrong(R"(.bodies: no body is named "aa"; allowed: a, b, b; the nearest is "a")"));
    EXPECT_EQ(with_pair(R"({"bodies": ["a", "b"], "friction": 0})"),
              wrong(R"(.bodies: several have the name "b"; give each a "name" of its own)"));
    EXPECT_EQ(with_pair(R"({"bodies": ["a"], "friction": 0})"),
              wrong(R"(.bodies: must be 2 texts, not ["a"])"));
    EXPECT_EQ(with_pair(R"({"body": "a", "friction": 0})"), wrong(".obstacle: is missing"));
    EXPECT_EQ(with_pair(R"({"body": "a", "obstacle": "floor", "friction": 0})"),
              wrong(R"(.obstacle: no obstacle is named "floor"; allowed: obstacles[0])"));
    EXPECT_EQ(with_pair(R"({"body": "a", "obstacle": 0, "friction": 0})"),
              wrong(".obstacle: must be a text, not 0"));
    EXPECT_EQ(with_pair(R"({"bodies": ["a", "a"], "obstacle": "obstacles[0]", "friction": 0})"),
              wrong(R"(.obstacle: must be beside "body" alone)"));
    EXPECT_EQ(with_pair(R"({"bodies": ["a", "a"]})"),
              wrong(R"(: says nothing of the two; needs "meet" or "friction")"));
    EXPECT_EQ(with_pair(R"({"bodies": ["a", "a"], "meet": false, "friction": 1})"),
              wrong(R"(.friction: has no meaning for what does not "meet")"));
    EXPECT_EQ(with_pair(R"({"bodies": ["a", "a"], "friction": -1})"),
              wrong(".friction: is -1, but must be between 0 and 10"));
    EXPECT_EQ(with_pair(R"({"meet": false})"), wrong(R"(: needs exactly one of "bodies" and "body")"));
    EXPECT_EQ(
        with_pair(R"({"bodies": ["a", "a"], "meet": false})", R"(, {"bodies": ["a", "a"], "friction": 0})"),
        "contact.pairs[1]: names the same two as contact.pairs[0]");
}

TEST(Scene, RefusesLoadsThatAreWrong) {
    const auto with_load = [](const std::string& load) {
        return complaint(with(R"("loads": [)" + load + "]"));
    };
    const std::string at = "bodies[0].loads[0]";
    EXPECT_EQ(with_load(R"({"force": [0, 0, 1], "factor": [[2, 3]]})"), "");
    EXPECT_EQ(with_load("{}"),
              at + R"(: needs exactly one of "force", "torque", "acceleration" and "pressure")");
    EXPECT_EQ(with_load(R"({"force": [0, 0, 1], "pressure": 5})"),
              at + R"(: needs exactly one of "force", "torque", "acceleration" and "pressure")");
    EXPECT_EQ(with_load(R"({"force": 5})"), at + ".force: must be three numbers, not 5");
    EXPECT_EQ(with_load(R"({"pressure": [1, 2, 3]})"), at + ".pressure: must be a number, not [1,2,3]");
    EXPECT_EQ(with_load(R"({"pressure": 5, "factor": 2})"), at + ".factor: must be pairs of numbers, not 2");
    EXPECT_EQ(with_load(R"({"pressure": 5, "factor": [[0, 1], [0, 2]]})"),
              at + ".factor: its times must increase, but 0 s follows 0 s");
    EXPECT_EQ(with_load(R"({"pressure": 5, "factor": [[0, 1], [1]]})"),
              at + ".factor: must be pairs of numbers, not [[0,1],[1]]");
    EXPECT_EQ(with_load(R"({"pressure": 5, "centre": [0, 0, 0]})"), at + R"(: unknown key "centre")");
}

TEST(Scene, ReadsKeyframesOfGravity) {
    const SceneSpec spec = parse_scene(
        with("", R"("gravity": [{"time": 1, "value": [0, 0, 0]}, {"time": 2.5, "value": [0, 0, -5]}])"), "");
    EXPECT_EQ(spec.gravity_keys.times, (std::vector<double>{1, 2.5}));
    EXPECT_EQ(spec.gravity_keys.values[1], Eigen::Vector3d(0, 0, -5));
    EXPECT_TRUE(parse_scene(with(""), "").gravity_keys.empty());
    const auto wrong = [](const std::string& keys) {
        return complaint(with("", R"("gravity": [)" + keys + "]"));
    };
    EXPECT_EQ(wrong(R"({"time": 1, "value": [0, 0, 0]}, {"time": 0.5, "value": [0, 0, 0]})"),
              "gravity[1].time: is 0.5, but must be later than 1 s, of the key before");
    EXPECT_EQ(wrong(R"({"time": 1})"), "gravity[0].value: is missing");
    EXPECT_EQ(wrong(R"({"time": 1, "value": 3})"), "gravity[0].value: must be three numbers, not 3");
    EXPECT_EQ(wrong("1, 2"), "gravity: must be three numbers, not [1,2]");
    EXPECT_EQ(wrong(R"({"time": 1, "value": [0, 0, 0]}, 3)"), "gravity[1]: must be an object, not 3");
}

TEST(CheckScene, LeavesPairsAloneThatDoNotMeet) {
    const auto problems = [](const std::string& pairs) {
        // The first body and obstacle are left out, so that the others have other numbers in the world.
        const SceneReading reading = read_scene(
            R"({"bodies": [{"body": "missing"}, {"body": "a"},
                           {"body": "b", "transform": {"translate": [0.9, 0.1, 0.1]}}],
                "obstacles": [{"mesh": {"file": "/nowhere.obj"}},
                              {"name": "floor", "plane": {"point": [0, 0, -0.1]}}],
                "contact": {"pairs": [)" +
                pairs + "]}}",
            "");
        const LoadedBody bodies[] = {{}, loaded_bar(), loaded_bar()};
        return check_scene(reading, bodies).problems;
    };
    EXPECT_EQ(problems("").size(), 3u);  // the file, two bodies that overlap, one in the floor
    EXPECT_EQ(problems(R"({"bodies": ["a", "b"], "meet": false})").size(), 2u);
    EXPECT_EQ(
        problems(R"({"bodies": ["b", "a"], "meet": false}, {"body": "a", "obstacle": "floor", "meet": false},
                          {"body": "b", "obstacle": "floor", "meet": false},
                          {"bodies": ["missing", "missing"], "meet": false})"),
        std::vector<std::string>{"obstacles[0]: /nowhere.obj: no such file"});
}

TEST(BuildWorld, PlacesLoadsInTheirRegionsAlsoFarAway) {
    for (const double far : {0.0, 1e7}) {
        const auto scene = [&](const std::string& load, const std::string& more = "") {
            return fmt::format(R"({{"bodies": [{{"body": "a", "transform": {{"translate": [{}, 0, 0]}},
                                   "material": {{"rayleigh_mass": 0}}, "loads": [{}]{}}}], "gravity": [0, 0, 0]}})",
                               far, load, more);
        };
        const auto region = [&](double least) {
            return fmt::format(R"("region": {{"box": {{"min": [{}, -1, -1], "max": [{}, 1, 1]}}}})",
                               far + least, far + 9);
        };
        World world = built_from(scene(R"({"force": [0, 6, 0], )" + region(0.45) + "}"), loaded_bar());
        world.step(1e-4);
        const Nodes& v = world.state(0).v;
        const Nodes& X = world.elastic(0).rest().X;
        Eigen::Index fastest = 0;
        v.col(1).maxCoeff(&fastest);
        EXPECT_GT(X(fastest, 0), 0.45);
        EXPECT_NEAR(v.col(1).dot(world.elastic(0).node_masses()), 6e-4, 1e-9);
        const auto refused = [&](const std::string& text) {
            return test::refusal([&] { built_from(text, loaded_bar()); });
        };
        EXPECT_EQ(refused(scene(R"({"torque": [0, 6, 0], )" + region(0.8) + "}")),
                  "bodies[0] (a): loads[0]: the region holds no node of the body");
        EXPECT_EQ(refused(scene(R"({"force": [0, 6, 0]}, {"pressure": 2, )" + region(0.8) + "}")),
                  "bodies[0] (a): loads[1]: the region holds no face of the body's surface");
        const std::string held =
            scene(R"({"force": [0, 6, 0], )" + region(0.45) + "}",
                  fmt::format(R"(, "pins": [{{"box": {{"min": [{}, -1, -1], "max": [{}, 1, 1]}}}}])",
                              far + 0.4, far + 9));
        const std::string why =
            "pins or grips hold all that it acts on, so it moves nothing; widen its region";
        EXPECT_EQ(refused(held), "bodies[0] (a): loads[0]: " + why);
        const LoadedBody loaded = loaded_bar();
        EXPECT_EQ(check_scene(read_scene(held, ""), std::span(&loaded, 1)).problems,
                  std::vector<std::string>{"bodies[0]: loads[0]: " + why});
    }
}

TEST(BuildWorld, SetsRulesForPairs) {
    const LoadedBody bodies[] = {loaded_bar(), loaded_bar()};
    const World world = build_world(
        parse_scene(R"({"bodies": [{"body": "a"}, {"body": "b", "transform": {"translate": [0, 0, 0.1]}}],
                        "obstacles": [{"sphere": {"radius": 1, "centre": [9, 9, 9]}}],
                        "contact": {"pairs": [{"bodies": ["b", "a"], "meet": false},
                                              {"body": "b", "obstacle": "obstacles[0]", "friction": 0.25}]}})",
                    ""),
        bodies);
    EXPECT_FALSE(world.pairs().meet(0, 1));
    EXPECT_TRUE(world.pairs().meet(0, 0));
    EXPECT_EQ(world.pairs().friction(party_of_obstacle(0), 1, 0.5), 0.25);
    EXPECT_EQ(world.pairs().friction(party_of_obstacle(0), 0, 0.5), 0.5);
}

}  // namespace
}  // namespace nbd
