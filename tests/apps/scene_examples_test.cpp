// Every scene in assets/scenes must run.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>
#include <utility>

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

TEST(HandScene, TendonsCloseOnTheEggLiftItAndLetItGo) {
    const TemporaryFolder folder;
    const Ran ran =
        run(folder / "", "simulate " NBD_ASSETS "/scenes/hand.json -o run.h5 --obj frames --quiet");
    EXPECT_EQ(ran.status, 0) << ran.err;
    // Frames are 50 ms apart.
    const auto egg = [&](int frame) {
        return read_surface(folder / fmt::format("frames/0_egg_{:06d}.obj", frame)).X;
    };
    const auto middle = [&](int frame) -> Eigen::RowVector3d { return egg(frame).colwise().mean(); };
    EXPECT_NEAR(middle(60).z() - middle(18).z(), 0.15, 0.01) << "lifted";
    for (int frame = 55; frame <= 68; ++frame)
        EXPECT_LT((middle(frame) - middle(60)).norm(), 2e-3) << "it slips in frame " << frame;
    EXPECT_LT(egg(90).col(2).minCoeff(), 0.01) << "let go";
}

/// The forces of the last step of a scene, by body and by what exerts them.
std::map<std::pair<std::string, std::string>, Eigen::Vector3d> last_forces(const TemporaryFolder& folder,
                                                                           const std::string& scene) {
    const Ran ran = run(folder / "", "simulate " NBD_ASSETS "/scenes/" + scene +
                                         ".json -o run.h5 --obj frames --reactions forces.csv --quiet");
    EXPECT_EQ(ran.status, 0) << ran.err;
    std::ifstream file(folder / "forces.csv");
    std::map<std::pair<std::string, std::string>, Eigen::Vector3d> forces;
    std::string line, time;
    std::getline(file, line);  // the header
    while (std::getline(file, line)) {
        std::vector<std::string> cells;
        std::istringstream row(line);
        for (std::string cell; std::getline(row, cell, ',');) cells.push_back(cell);
        if (cells.size() < 8) continue;
        if (cells[1] != std::exchange(time, cells[1])) forces.clear();
        forces[{cells[2], cells[4]}] = {std::stod(cells[5]), std::stod(cells[6]), std::stod(cells[7])};
    }
    return forces;
}

TEST(BridgeScene, BearingsCarryDeckAndLoad) {
    const TemporaryFolder folder;
    auto forces = last_forces(folder, "bridge");
    constexpr double g = 9.81, deck = 800 * 2 * 0.24 * 0.24, load = 5000 * 0.2 * 0.2 * 0.2;
    const double left = forces[{"deck", "left bearing"}].z(), right = forces[{"deck", "right bearing"}].z();
    EXPECT_NEAR(left + right, g * (deck + load), 1e-3 * g * (deck + load));
    EXPECT_NEAR(right - left, g * load * 0.7 / 0.85,
                0.1 * g * load);  // 0.7 m from the middle; welds bear moments
    const double drive = forces[{"load", "drive"}].z();
    EXPECT_NEAR(drive, g * load, 1e-2 * g * load);
}

TEST(ChainScene, HoldsTogetherAndItsRopeHolds) {
    const TemporaryFolder folder;
    last_forces(folder, "chain");
    const auto middle = [&](const std::string& body, int frame) -> Eigen::RowVector3d {
        return read_surface(folder / fmt::format("frames/{}_{:06d}.obj", body, frame)).X.colwise().mean();
    };
    const Eigen::RowVector3d pivot(0, 0, 1), rope(0.95, 0, 1.6);
    const double arm = (middle("0_first", 0) - pivot).norm();
    for (int frame = 0; frame <= 100; frame += 10) {
        EXPECT_NEAR((middle("0_first", frame) - pivot).norm(), arm, 1e-4) << frame;
        EXPECT_LT((middle("1_second", frame) - middle("0_first", frame)).norm(), 0.201) << frame;
        EXPECT_LT((middle("2_third", frame) - middle("1_second", frame)).norm(), 0.201) << frame;
        EXPECT_LT((middle("3_fourth", frame) - middle("2_third", frame)).norm(), 0.201) << frame;
        EXPECT_LT((middle("4_pad", frame) - rope).norm(), 1.3 + 0.1) << frame;
    }
}

TEST(DoorScene, LeansOnItsSeal) {
    const TemporaryFolder folder;
    auto forces = last_forces(folder, "door");
    const Eigen::Vector3d seal = forces[{"door", "seal"}], hinge = forces[{"door", "hinge"}];
    EXPECT_GT(seal.norm(), 20);
    EXPECT_NEAR(seal.z() + hinge.z(), 9.81 * 600 * 0.12 * 0.12, 0.01);
    EXPECT_LT((seal + hinge).head<2>().norm(), 0.01);
}

TEST(ShelfScene, BendsAsABeamUnderItsCrate) {
    const TemporaryFolder folder;
    auto forces = last_forces(folder, "shelf");
    constexpr double g = 9.81, area = 0.12 * 0.12, stiffness = 1e7 * area * area / 12;
    constexpr double board = 700 * area * g, crate = 1500 * 0.15 * 0.15 * 0.15 * g;
    EXPECT_NEAR((forces[{"board", "pins[0]"}].z()), board + crate, 1e-5 * (board + crate));
    EXPECT_NEAR((forces[{"board", "crate"}].z()), -crate, 1e-5 * crate);
    EXPECT_LT((forces[{"board", "pins[0]"}].head<2>().norm()), 1e-5 * crate);
    const auto sag = [&](int frame) {
        return -read_surface(folder / fmt::format("frames/0_board_{:06d}.obj", frame)).X.col(2).minCoeff() -
               0.06;
    };
    // Of its own weight, and of the crate's at 0.85 m.
    const double expected = board / (8 * stiffness) + crate * 0.85 * 0.85 * (3 - 0.85) / (6 * stiffness);
    EXPECT_NEAR(sag(5), expected, 0.05 * expected);
    EXPECT_NEAR(sag(1), expected / 5, 0.05 * expected);
}

TEST(FingerScene, BendsByPressureAndPressesOnTheBall) {
    const TemporaryFolder folder;
    auto forces = last_forces(folder, "finger");
    // The faces at the free end, which hangs down.
    const TriMesh rest = read_surface(folder / "frames/0_finger_000000.obj");
    std::vector<int> end;
    for (int f = 0; f < rest.F.rows(); ++f) {
        double highest = -1;
        for (const int vertex : rest.F.row(f)) highest = std::max(highest, rest.X(vertex, 2));
        if (highest < -0.0499) end.push_back(f);
    }
    ASSERT_EQ(end.size(), 32u);
    const auto degrees = [&](int frame) {  // by which the end turns to the ball
        const Nodes X = read_surface(folder / fmt::format("frames/0_finger_{:06d}.obj", frame)).X;
        Eigen::RowVector3d normal = Eigen::RowVector3d::Zero();
        for (const int f : end) {
            const Eigen::RowVector3d a = X.row(rest.F(f, 0));
            normal += (X.row(rest.F(f, 1)) - a).cross(X.row(rest.F(f, 2)) - a);
        }
        return std::atan2(-normal.x(), -normal.z()) * 180 / std::numbers::pi;
    };
    for (int frame = 10; frame <= 50; frame += 10)
        EXPECT_GT(degrees(frame), degrees(frame - 10) + 0.3) << frame;
    EXPECT_GT(degrees(50), 3);
    const Eigen::Vector3d ball = forces[{"finger", "ball"}], pin = forces[{"finger", "pins[0]"}];
    EXPECT_GT(ball.x(), 0.05);
    // At rest, the pins carry the weight and what the ball does.
    const double weight = 9.81 * 1100 * (0.1 * 0.02 * 0.02 - 4 * 0.019 * 0.008 * 0.006);
    EXPECT_LT((ball + pin - Eigen::Vector3d(0, 0, weight)).norm(), 0.01 * weight);
}

INSTANTIATE_TEST_SUITE_P(All, SceneExample, ::testing::ValuesIn(scenes()),
                         [](const auto& info) { return info.param; });

}  // namespace
}  // namespace nbd::test
