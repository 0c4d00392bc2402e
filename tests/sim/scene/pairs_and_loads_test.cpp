// Rules for pairs, loads and gravity in scenes.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "meshing/body/make_body.hpp"
#include "meshing/body/rigid_body.hpp"
#include "sim/scene/scene.hpp"
#include "sim/scene/scene_check.hpp"
#include "tests/sim/scene/scene_text.hpp"
#include "tests/support/box_body.hpp"
#include "tests/support/box_mesh.hpp"
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

/// A box within a box.
LoadedBody loaded_hollow_box() {
    TetMesh tets = test::box_mesh({3, 3, 3}, {3, 3, 3});
    std::vector<int> kept;
    for (int t = 0; t < tets.T.rows(); ++t) {
        Eigen::RowVector3d centre = Eigen::RowVector3d::Zero();
        for (const int node : tets.T.row(t)) centre += tets.X.row(node) / 4;
        if ((centre - Eigen::RowVector3d::Constant(1.5)).cwiseAbs().maxCoeff() > 0.5) kept.push_back(t);
    }
    tets.T = Tets(tets.T(kept, Eigen::all));
    return {std::make_shared<const Body>(make_body("box", std::move(tets))), nullptr};
}

TEST(Scene, LoadsCavitiesByTheirNumbers) {
    const LoadedBody loaded = loaded_hollow_box();
    const auto scene = [](const std::string& loads, const std::string& more = "") {
        return R"({"bodies": [{"body": "a.h5", "material": {"rayleigh_mass": 0}, "loads": [)" + loads + "]" +
               more + R"(}], "gravity": [0, 0, 0]})";
    };
    World world = built_from(scene(R"({"pressure": 10, "cavity": 0, "factor": [[0, 1], [1, 3]]},
                                      {"gas": {"pressure": 2e5, "ambient": 1e5}, "cavity": 0},
                                      {"pressure": 1e3})",
                                   R"(, "transform": {"scale": 0.1, "translate": [1e7, 0, 0]})"),
                             loaded);
    ASSERT_EQ(world.cavities().size(), 1u);
    EXPECT_NEAR(world.cavities()[0].volume, 1e-3, 1e-12);
    EXPECT_NEAR(world.cavities()[0].pressure, 1e5 + 10, 1e-6) << "what presses from outside is not in it";
    EXPECT_TRUE(world.reactions().empty());
    ASSERT_EQ(world.step(1e-4).failure, "");
    ASSERT_EQ(world.reactions().size(), 1u);
    EXPECT_EQ(world.reactions()[0].by, ReactionBy::cavity);
    EXPECT_EQ(world.reactions()[0].pressure, world.cavities()[0].pressure);

    const auto refusal = [&](const std::string& loads, const LoadedBody& body) {
        return test::error_of([&] { built_from(scene(loads), body); });
    };
    const std::string of_body = "bodies[0] (a): ";
    EXPECT_EQ(refusal(R"({"pressure": 1, "cavity": 1})", loaded),
              of_body + "loads[0].cavity: is 1, but the body has 1 cavity, allowed: 0 to 0");
    EXPECT_EQ(refusal(R"({"pressure": 1, "cavity": 0})", loaded_bar()),
              of_body +
                  "loads[0].cavity: is 0, but the body has no cavity: no part of its surface lies closed "
                  "within another");
    EXPECT_EQ(refusal(R"({"gas": {}, "cavity": 0}, {"gas": {}, "cavity": 0})", loaded),
              of_body + "loads[1].cavity: the gas of loads[0] is in cavity 0 already");
    const Body& hollow = *loaded.body;
    const LoadedBody rigid{std::make_shared<const Body>(make_rigid_body("box", hollow.surface, 1000)),
                           nullptr};
    EXPECT_EQ(refusal(R"({"gas": {}, "cavity": 0})", rigid).find(of_body + "material"), 0u)
        << "a rigid body has no damping";
    EXPECT_EQ(test::error_of([&] {
                  built_from(R"({"bodies": [{"body": "a.h5", "loads": [{"gas": {}, "cavity": 0}]}]})", rigid);
              }),
              of_body + "loads[0].gas: a rigid body's cavities keep their volumes, so it does nothing");
}

TEST(Scene, RefusesLoadsInCavitiesThatAreWrong) {
    const auto with_load = [](const std::string& load) {
        return complaint(R"({"bodies": [{"body": "a.h5", "loads": [)" + load + "]}]}");
    };
    const std::string at = "bodies[0].loads[0]";
    EXPECT_EQ(with_load(R"({"gas": {}})"), at + ".cavity: is missing");
    EXPECT_EQ(with_load(R"({"pressure": 1, "cavity": 0.5})"),
              at + ".cavity: is 0.5, but must be a whole number");
    EXPECT_EQ(with_load(R"({"force": [0, 0, 1], "cavity": 0})"), at + ".cavity: is for a pressure or a gas");
    EXPECT_EQ(with_load(R"({"pressure": 1, "cavity": -1})"),
              at + ".cavity: is -1, but must be between 0 and 1000000");
    EXPECT_EQ(
        with_load(
            R"({"pressure": 1, "cavity": 0, "region": {"sphere": {"centre": [0, 0, 0], "radius": 1}}})"),
        at + R"(.cavity: must not be beside "region")");
    EXPECT_EQ(
        with_load(R"({"gas": {}, "cavity": 0, "region": {"sphere": {"centre": [0, 0, 0], "radius": 1}}})"),
        at + R"(.region: is not for a gas, which is in a "cavity")");
    EXPECT_EQ(with_load(R"({"gas": {"pressure": 0}, "cavity": 0})"),
              at + ".gas.pressure: is 0, but must be between 1e-30 and 1e30");
    EXPECT_EQ(with_load(R"({"gas": {"exponent": 0.9}, "cavity": 0})"),
              at + ".gas.exponent: is 0.9, but must be between 1 and 10");
    EXPECT_EQ(with_load(R"({"gas": {"temperature": 300}, "cavity": 0})").find(at + ".gas"), 0u);
    EXPECT_EQ(with_load(R"({"gas": {}, "cavity": 0, "factor": [[0, 1], [1, -1]]})"),
              at + ".factor: of a gas is how much of it there is, and must not be negative");
    EXPECT_EQ(with_load(R"({"gas": {}, "pressure": 1, "cavity": 0})").find(at + ": needs exactly one of"),
              0u);
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
    EXPECT_EQ(
        with_load("{}"),
        at + R"(: needs exactly one of "force", "torque", "acceleration", "pressure", "gas" and "wind")");
    EXPECT_EQ(
        with_load(R"({"force": [0, 0, 1], "pressure": 5})"),
        at + R"(: needs exactly one of "force", "torque", "acceleration", "pressure", "gas" and "wind")");
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
