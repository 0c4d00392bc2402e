#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/apps/small_files.hpp"

namespace nbd::test {
namespace {

class ValidateTest : public SmallFiles {
 protected:
    static void SetUpTestSuite() {
        SmallFiles::SetUpTestSuite();
        write("good.json", R"({"bodies": [{"body": "box.h5", "tree": "tree.h5", "bounds": "nbd",
            "margin": 0.1}]})");
        write("bad.json", R"({
            "bodies": [{"body": "box.h5", "pins": [{"sphere": {"centre": [0, 0, 9], "radius": 1}}]},
                       {"surface": "box.obj", "transform": {"translate": [0.1, 0.01, 0.02]}},
                       {"body": "none.h5"}, {"tets": "box.obj"}, {"body": "box.h5", "velosity": 1}],
            "obstacles": [{"plane": {"point": [0, 0, 0.05]}}, {"mesh": {"file": "none.obj"}}],
            "time": {"dt": "small"}})");
        write("twice.json", "{\n\"bodies\": [{\"body\": \"box.h5\", \"body\": \"box.h5\"}]}");
    }
};

TEST_F(ValidateTest, ReportsEveryProblemOfEveryScene) {
    const Ran ran = run("validate good.json bad.json none.json twice.json");
    EXPECT_EQ(ran.status, 1);
    EXPECT_EQ(
        ran.out,
        "good.json: valid\n"
        "bad.json: bodies[4]: unknown key \"velosity\"; the nearest known one is \"velocity\"\n"
        "bad.json: time.dt: must be a number, not \"small\"\n"
        "bad.json: bodies[2]: none.h5: no such file\n"
        "bad.json: bodies[3]: box.obj: tetrahedra are read from .msh, .mesh, .vtk, .vtu and .inp, not from '.obj'\n"
        "bad.json: bodies[0].pins[0]: the region holds no node of the body\n"
        "bad.json: obstacles[1]: none.obj: no such file\n"
        "bad.json: bodies[1]: overlaps bodies[0] at the start: 60 pairs of faces cross; \"resolve_start\": "
        "true moves bodies apart before the first step\n"
        "bad.json: bodies[0]: is 0.05 m deep in obstacles[0] at the start; \"resolve_start\": true moves "
        "bodies apart before the first step\n"
        "bad.json: bodies[1]: is 0.03 m deep in obstacles[0] at the start; \"resolve_start\": true moves "
        "bodies apart before the first step\n"
        "none.json: no such file\n"
        "twice.json: bodies[0].body: this key occurs twice\n");
    EXPECT_EQ(ran.err, "nbdtree: error: 11 problems in 3 of 4 scenes\n");
}

TEST_F(ValidateTest, ReportsInJson) {
    const Ran ran = run("validate good.json twice.json --json");
    EXPECT_EQ(ran.status, 1);
    const nlohmann::json scenes = nlohmann::json::parse(ran.out)["scenes"];
    ASSERT_EQ(scenes.size(), 2u);
    EXPECT_EQ(scenes[0]["scene"], "good.json");
    EXPECT_TRUE(scenes[0]["problems"].empty());
    EXPECT_EQ(scenes[1]["problems"],
              (std::vector<std::string>{"twice.json: bodies[0].body: this key occurs twice"}));
    make("validate good.json -q");
}

}  // namespace
}  // namespace nbd::test
