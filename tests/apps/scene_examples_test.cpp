// Every scene in assets/scenes must run.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "meshing/formats/read_surface.hpp"
#include "tests/apps/small_files.hpp"
#include "tests/support/file_damage.hpp"

namespace nbd::test {
namespace {

/// Names of the example scenes, which `nbdtree validate assets/scenes/*.json` checks.
std::vector<std::string> scenes() {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(NBD_ASSETS "/scenes")) {
        if (entry.path().extension() == ".json") names.push_back(entry.path().stem());
    }
    return names;
}

class SceneExample : public BoxFolder, public ::testing::WithParamInterface<std::string> {};

TEST_P(SceneExample, IsValidAndRuns) {
    const std::string scene = NBD_ASSETS "/scenes/" + GetParam() + ".json";
    const std::string recording = GetParam() + ".h5";
    EXPECT_EQ(text("validate " + scene), scene + ": valid\n");
    EXPECT_EQ(result("simulate " + scene + " -o " + recording + " --frames 2")["frames"], 2);
    EXPECT_TRUE(std::filesystem::exists(folder() / recording));
    EXPECT_FALSE(std::filesystem::exists(folder() / (recording + ".journal")));
}

TEST_P(SceneExample, IsDocumented) {
    EXPECT_NE(read_bytes(NBD_ASSETS "/scenes/README.md").find("`" + GetParam() + ".json`"),
              std::string::npos);
}

/// Runs a scene of the block on a slope of 20 degrees to its end. Returns how far its centre is down the
/// slope from the start, metres, in each of its 101 frames, 10 ms apart.
std::vector<double> way_down(const std::string& scene) {
    const TemporaryFolder folder;
    const Ran ran =
        run(folder / "", "simulate " NBD_ASSETS "/scenes/" + scene + ".json -o run.h5 --obj frames --quiet");
    EXPECT_EQ(ran.status, 0) << ran.err;
    const double slope = 20 * std::numbers::pi / 180;
    const Eigen::RowVector3d down(std::cos(slope), 0, -std::sin(slope));
    std::vector<double> way;
    for (int frame = 0; frame <= 100; ++frame)
        way.push_back(read_surface(folder / fmt::format("frames/0_block_{:06d}.obj", frame))
                          .X.colwise()
                          .mean()
                          .dot(down));
    for (double& distance : way) distance -= way.front();
    return way;
}

TEST(SlopeScenes, TheBlockHolds) {
    const std::vector<double> way = way_down("slope_holds");
    EXPECT_LT(way[20], 0.006);  // it lands
    EXPECT_NEAR(way[100], way[50], 1e-5);
}

TEST(SlopeScenes, TheBlockSlidesAsFastAsFrictionLets) {
    const std::vector<double> way = way_down("slope_slides");
    const double slope = 20 * std::numbers::pi / 180, rate = 9.81 * (std::sin(slope) - 0.2 * std::cos(slope));
    const double from_ways = ((way[100] - way[90]) - (way[60] - way[50])) / (0.1 * 0.4);
    EXPECT_NEAR(from_ways, rate, 0.1 * rate);  // the material's damping slows it down a little
}

TEST(GripperScene, LiftsAndCarriesTheEggAndLetsItGo) {
    const TemporaryFolder folder;
    const Ran ran =
        run(folder / "", "simulate " NBD_ASSETS "/scenes/gripper.json -o run.h5 --obj frames --quiet");
    EXPECT_EQ(ran.status, 0) << ran.err;
    // Frames are 50 ms apart.
    const auto surface = [&](const std::string& body, int frame) {
        return read_surface(folder / fmt::format("frames/{}_{:06d}.obj", body, frame)).X;
    };
    const auto egg = [&](int frame) -> Eigen::RowVector3d {
        return surface("0_egg", frame).colwise().mean();
    };
    EXPECT_NEAR(egg(60).z() - egg(10).z(), 0.2, 0.01) << "lifted";
    EXPECT_NEAR(egg(60).y() - egg(10).y(), 0.2, 0.01) << "carried";
    for (int frame = 60; frame <= 120; ++frame)
        EXPECT_LT((egg(frame) - egg(60)).norm(), 1e-3) << "it slips in frame " << frame;
    EXPECT_GT(surface("0_egg", 120).col(2).minCoeff(), 0.19);
    EXPECT_LT(surface("0_egg", 140).col(2).minCoeff(), 0.02) << "let go";
}

INSTANTIATE_TEST_SUITE_P(All, SceneExample, ::testing::ValuesIn(scenes()),
                         [](const auto& info) { return info.param; });

}  // namespace
}  // namespace nbd::test
