// Every scene in assets/scenes must run.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/apps/command.hpp"
#include "tests/support/temporary_folder.hpp"

namespace nbd::test {
namespace {

/// Names of the example scenes, except demo.json, which needs files from apps/demo.
std::vector<std::string> scenes() {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(NBD_ASSETS "/scenes")) {
        const std::string name = entry.path().stem();
        if (entry.path().extension() == ".json" && name != "scene.schema" && name != "demo")
            names.push_back(name);
    }
    return names;
}

class SceneExample : public ::testing::TestWithParam<std::string> {
 protected:
    TemporaryFolder folder_;
};

TEST_P(SceneExample, IsValidAndRuns) {
    const std::string scene = NBD_ASSETS "/scenes/" + GetParam() + ".json";
    const Ran valid = run(folder_ / "", {"validate", scene});
    EXPECT_EQ(valid.out, scene + ": valid\n");
    EXPECT_EQ(valid.status, 0) << valid.err;
    const Ran ran = run(folder_ / "", {"simulate", scene, "-o", "run.h5", "--frames", "2", "--json"});
    ASSERT_EQ(ran.status, 0) << ran.err;
    EXPECT_EQ(nlohmann::json::parse(ran.out)["frames"], 2);
    EXPECT_TRUE(std::filesystem::exists(folder_ / "run.h5"));
    EXPECT_FALSE(std::filesystem::exists(folder_ / "run.h5.journal"));
}

TEST_P(SceneExample, IsDocumented) {
    std::ifstream file(NBD_ASSETS "/scenes/README.md");
    const std::string readme{std::istreambuf_iterator<char>(file), {}};
    EXPECT_NE(readme.find("`" + GetParam() + ".json`"), std::string::npos);
}

INSTANTIATE_TEST_SUITE_P(All, SceneExample, ::testing::ValuesIn(scenes()),
                         [](const auto& info) { return info.param; });

}  // namespace
}  // namespace nbd::test
