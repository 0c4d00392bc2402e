// What becomes of scenes in assets/scenes with many parts: gears and a belt, a heap, muscles.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <utility>

#include "meshing/formats/read_surface.hpp"
#include "tests/apps/command.hpp"
#include "tests/support/file_damage.hpp"
#include "tests/support/temporary_folder.hpp"

namespace nbd::test {
namespace {

constexpr double degree = std::numbers::pi / 180;

/// A scene of assets/scenes as JSON, whose files can be found from anywhere.
nlohmann::json shipped_scene(const std::string& name) {
    nlohmann::json scene =
        nlohmann::json::parse(read_bytes(NBD_ASSETS "/scenes/" + name + ".json"), nullptr, true, true);
    const auto from_here = [](nlohmann::json& file) {
        file = NBD_ASSETS "/scenes/" + file.get<std::string>();
    };
    for (nlohmann::json& body : scene["bodies"])
        from_here(body.contains("tets") ? body["tets"] : body["surface"]);
    if (scene.contains("obstacles"))
        for (nlohmann::json& obstacle : scene["obstacles"])
            if (obstacle.contains("mesh")) from_here(obstacle["mesh"]["file"]);
    return scene;
}

/// A finished run of a scene, its surfaces in all frames and its forces.
class RunOfScene {
 public:
    explicit RunOfScene(nlohmann::json scene) : scene_(std::move(scene)) {
        std::ofstream(folder_ / "scene.json") << scene_;
        const Ran ran = run(folder_ / "",
                            "simulate scene.json -o run.h5 --obj frames --csv steps.csv "
                            "--reactions forces.csv --quiet");
        EXPECT_EQ(ran.status, 0) << ran.err;
        warnings_ = ran.err;
    }

    const std::string& warnings() const { return warnings_; }

    TriMesh surface(int body, int frame) const {
        const std::string name = scene_["bodies"][body]["name"];
        return read_surface(folder_ / fmt::format("frames/{}_{}_{:06d}.obj", body, name, frame));
    }

    /// Mean force on a body by what exerts it, and torque about the origin, from one time to another.
    Eigen::Vector<double, 6> load(const std::string& body, const std::string& by, double from,
                                  double to) const {
        Eigen::Vector<double, 6> sum = Eigen::Vector<double, 6>::Zero();
        int steps = 0;
        for (const std::vector<std::string>& row : rows("forces.csv")) {
            if (std::stod(row[1]) < from || std::stod(row[1]) > to || row[2] != body || row[4] != by)
                continue;
            for (int i = 0; i < 6; ++i) sum(i) += std::stod(row[5 + i]);
            ++steps;
        }
        EXPECT_GT(steps, 0) << body << " by " << by;
        return sum / std::max(steps, 1);
    }

    /// The last number of a column of the table of steps.
    double at_end(const std::string& column) const {
        const std::vector<std::string> header = cells(lines(read_bytes(folder_ / "steps.csv"))[0]);
        const auto at = std::ranges::find(header, column) - header.begin();
        return std::stod(rows("steps.csv").back()[static_cast<std::size_t>(at)]);
    }

 private:
    std::vector<std::vector<std::string>> rows(const std::string& file) const {
        std::vector<std::vector<std::string>> all;
        for (const std::string& line : lines(read_bytes(folder_ / file))) all.push_back(cells(line));
        all.erase(all.begin());
        return all;
    }

    TemporaryFolder folder_;
    nlohmann::json scene_;
    std::string warnings_;
};

/// The angle about y by which a body turns from one frame to another, degrees, less than half a turn.
double turn(const RunOfScene& run, int body, int from, int to) {
    Nodes a = run.surface(body, from).X, b = run.surface(body, to).X;
    a.rowwise() -= a.colwise().mean().eval();
    b.rowwise() -= b.colwise().mean().eval();
    const double across = (a.col(2).cwiseProduct(b.col(0)) - a.col(0).cwiseProduct(b.col(2))).sum();
    return std::atan2(across, (a.col(0).cwiseProduct(b.col(0)) + a.col(2).cwiseProduct(b.col(2))).sum()) /
           degree;
}

TEST(GearTrainScene, TurnsAsTeethAndRadiiSayAndTellsItsForces) {
    nlohmann::json scene = shipped_scene("gear_train");
    scene["time"]["frames"] = 32;
    const RunOfScene run(scene);
    // The motor goes evenly from frame 13 (0.26 s) on. Two teeth of the wheel pass by in 30 degrees of it.
    constexpr int from = 16, to = 32;
    const double driver = turn(run, 0, from, to), wheel = turn(run, 1, from, to),
                 pulley = turn(run, 2, from, to);
    EXPECT_NEAR(driver, 180 * 0.32, 0.1);
    EXPECT_NEAR(wheel / driver, -12.0 / 24, 0.01 * 0.5);
    // To the middle of the belt. It creeps, since it is longer where it is tauter.
    const double ratio = (24 + 2) / (36 + 2.0);
    EXPECT_LT(pulley / wheel, ratio);
    EXPECT_NEAR(pulley / wheel, ratio, 0.05 * ratio);

    // The belt turns the pulley against its damper.
    const Eigen::Vector<double, 6> belt = run.load("pulley", "belt", 0.32, 0.64);
    const double axle = run.surface(2, to).X.col(0).mean();
    const double torque = belt(4) + axle * belt(2);  // about the axle
    EXPECT_NEAR(torque, 0.05 * pulley * degree / 0.32, 0.03 * std::abs(torque));
    // Both of its halves pull the carriage.
    const double tension = run.load("carriage", "tension", 0.32, 0.64)(0);
    EXPECT_GT(tension, 3);
    EXPECT_NEAR(tension, -belt(0), 0.01 * tension);
    EXPECT_EQ(run.warnings(), "");
}

TEST(HeapScene, BodiesPourOntoTheGroundAndNoneFallsThrough) {
    nlohmann::json scene = shipped_scene("heap");
    constexpr int count = 6;  // three rigid and three soft ones; the hundred take long
    scene["bodies"].erase(scene["bodies"].begin() + count, scene["bodies"].end());
    const RunOfScene run(scene);
    const nlohmann::json& heights = scene["obstacles"][0]["heights"];
    const double spacing = heights["spacing"], low = heights["transform"]["translate"][0];
    const auto& table = heights["table"];
    const int cells_a_side = static_cast<int>(table.size()) - 1;
    double fastest = 0;  // of blocks and bars: rigid eggs roll on, as nothing resists that
    for (int body = 0; body < count; ++body) {
        const Nodes X = run.surface(body, 40).X, before = run.surface(body, 39).X;
        const double speed = (X - before).rowwise().norm().maxCoeff() / 0.05;
        if (scene["bodies"][body]["name"].get<std::string>().rfind("egg", 0) != 0)
            fastest = std::max(fastest, speed);
        EXPECT_LT(speed, 1) << body;
        for (Eigen::Index v = 0; v < X.rows(); ++v) {
            const int i = static_cast<int>(std::floor((X(v, 0) - low) / spacing)),
                      j = static_cast<int>(std::floor((X(v, 1) - low) / spacing));
            ASSERT_TRUE(i >= 0 && i < cells_a_side && j >= 0 && j < cells_a_side) << "beside the ground";
            const double ground =
                std::min({table[j][i].get<double>(), table[j][i + 1].get<double>(),
                          table[j + 1][i].get<double>(), table[j + 1][i + 1].get<double>()});
            ASSERT_GT(X(v, 2), ground) << body;
            ASSERT_LT(X(v, 2), 0.39) << body << " is still in the hopper";
        }
    }
    EXPECT_LT(fastest, 0.02) << "at rest";
}

/// The angle by which the free end of the arm turns up to a frame, degrees.
double bend(const RunOfScene& run, int frame) {
    const Nodes rest = run.surface(0, 0).X, X = run.surface(0, frame).X;
    Eigen::RowVector3d across = Eigen::RowVector3d::Zero();
    for (Eigen::Index v = 0; v < X.rows(); ++v)
        if (rest(v, 2) > 0.1999) across += rest(v, 0) * X.row(v);
    return std::atan2(-across.z(), across.x()) / degree;
}

TEST(MuscleScene, CurlsTheArmAsMuchAsABeam) {
    nlohmann::json scene = shipped_scene("muscle");
    // Half of a beam of height H pulls by a stress s: its curvature is 3/2 s / (E H), for small strains.
    const auto curvature = [](double stress) { return 1.5 * stress / (1e5 * 0.02); };
    const RunOfScene run(scene);
    for (int frame = 1; frame <= 6; ++frame) EXPECT_GT(bend(run, frame), bend(run, frame - 1) + 14) << frame;
    EXPECT_GT(bend(run, 6), 100);
    EXPECT_LT(run.load("arm", "pins[0]", 0, 1).norm(), 1e-6) << "a muscle is no outer force";

    scene["bodies"][0]["muscles"][0]["stress"] = 150;
    scene["time"]["static"]["increments"] = 1;
    const double expected = curvature(150) * 0.2 / degree;
    EXPECT_NEAR(bend(RunOfScene(scene), 1), expected, 0.02 * expected);
}

}  // namespace
}  // namespace nbd::test
