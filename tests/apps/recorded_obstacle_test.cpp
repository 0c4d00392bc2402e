// Obstacles that deform by a recording.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <string>
#include <vector>

#include "apps/cli/load_body.hpp"
#include "sim/scene/build_world.hpp"
#include "tests/support/box_body.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/temporary_folder.hpp"
#include "training/files/recording.hpp"

namespace nbd {
namespace {

using Eigen::Vector3d;

class RecordedObstacle : public ::testing::Test {
 protected:
    /// A body file, another one, and a recording of the first that rises and bends in 11 frames of 0.1 s.
    RecordedObstacle() {
        save_body(folder_ / "bar.h5", bar_);
        save_body(folder_ / "other.h5", test::box_body({1, 0.4, 0.3}, {4, 2, 2}));
        RecordingWriter file(folder_ / "run.h5", origin_);
        TrajectoryInfo info;
        info.id = 2;
        info.body_hash = body_hash(bar_);
        const int nodes = static_cast<int>(bar_.tets.X.rows());
        const int handle = file.begin_trajectory(info, nodes);
        for (int frame = 0; frame <= 10; ++frame) file.add_frame(handle, 0.1 * frame, pose(0.1 * frame));
        file.end_trajectory(handle);
        info.id = 5;
        file.begin_trajectory(info, nodes);
        file.finish();
        folder_.write("text.h5", "no recording");
    }

    Vertices pose(double time) const {
        Nodes x = bar_.tets.X;
        for (Eigen::Index i = 0; i < x.rows(); ++i) x(i, 2) += time * (1 + x(i, 0) * x(i, 0));
        return x.cast<float>();
    }

    SceneSpec scene(const std::string& recording, const std::string& more = "") const {
        SceneSpec spec = parse_scene(R"({"bodies": [{"body": "bar.h5"}], "obstacles": [{"recording": {)" +
                                         recording + "}" + more + "}]}",
                                     folder_.path());
        SceneFiles().load_recordings(spec);
        return spec;
    }

    test::TemporaryFolder folder_;
    Body bar_ = test::fine_box_body({1, 0.2, 0.2}, {4, 1, 1}, 1);
    Vector3d origin_{0, 0, 7};
};

TEST_F(RecordedObstacle, IsWhereTheBodyWasAtTheTimesThatAreTold) {
    const SceneSpec spec = scene(
        R"("file": "run.h5", "body": "bar.h5", "trajectory": 2, "start": 0.5, "speed": 2,
           "transform": {"scale": 2, "translate": [0, 0, 1]})",
        R"(, "velocity": [1, 0, 0])");
    const Obstacle obstacle = make_obstacle(spec.obstacles[0]);
    for (const double time : {-1.0, 0.0, 0.5, 0.53, 0.7, 1.0, 9.0}) {
        const double recorded = std::clamp(2 * (time - 0.5), 0.0, 1.0);
        const Nodes expected =
            (2 * (embedded(bar_.W, Nodes(pose(recorded).cast<double>())).rowwise() + origin_.transpose()))
                .rowwise() +
            Eigen::RowVector3d(0, 0, 1);
        EXPECT_LT((mesh_positions(obstacle, time) - expected).cwiseAbs().maxCoeff(), 1e-5) << time;
    }
    EXPECT_FALSE(obstacle.stands());
    EXPECT_EQ(obstacle.motion.at(2).translation, Vector3d(2, 0, 0));
    EXPECT_EQ(scene_inputs(spec).size(), 3u);
}

TEST_F(RecordedObstacle, CountsFromTheOriginOfAWorldFarAway) {
    SceneSpec spec = parse_scene(
        R"({"bodies": [{"body": "bar.h5", "transform": {"translate": [1e6, 0, 9]}}],
            "obstacles": [{"recording": {"file": "run.h5", "body": "bar.h5", "trajectory": 2,
                                         "transform": {"translate": [1e6, 0, 0]}}}]})",
        folder_.path());
    Output silent;
    silent.quiet = true;
    std::vector<LoadedBody> bodies = load_bodies(spec, silent);
    make_trees(spec, bodies);
    World world = build_world(spec, bodies);
    ASSERT_GT(world.origin().norm(), 1e5);
    const Nodes x = mesh_positions(world.obstacles()[0], 0);
    EXPECT_LT(std::abs(x.col(0).mean() + world.origin().x() - 1e6), 1e-3);
    ASSERT_EQ(world.step(5e-3).failure, "");
}

TEST_F(RecordedObstacle, RefusesWhatIsNoRecordingOfTheBody) {
    const auto refusal = [&](const std::string& recording) {
        return test::error_of([&] { scene(recording); });
    };
    const std::string at = "obstacles[0].recording: ", run = (folder_ / "run.h5").string(),
                      trajectory = R"(, "trajectory": 2)";
    EXPECT_EQ(refusal(R"("file": "run.h5", "body": "other.h5")" + trajectory),
              at + run + ": trajectory 2 is of another body than " + (folder_ / "other.h5").string());
    EXPECT_EQ(refusal(R"("file": "run.h5", "body": "bar.h5", "trajectory": 3)"),
              at + run + ": has no trajectory 3, but 2 of them from 2 to 5");
    EXPECT_EQ(refusal(R"("file": "run.h5", "body": "bar.h5", "trajectory": 5)"),
              at + run + ": trajectory 5 has no frames");
    for (const std::string file : {"text.h5", "none.h5", "bar.h5"}) {
        const std::string text = refusal(R"("file": ")" + file + R"(", "body": "bar.h5")" + trajectory);
        EXPECT_EQ(text.find(at + (folder_ / file).string()), 0u) << text;
        EXPECT_EQ(text.find('\n'), std::string::npos);
    }
    EXPECT_EQ(refusal(R"("file": "run.h5", "body": "run.h5")").find(at + run), 0u);
    const auto complaint = [&](const std::string& recording) {
        return test::refusal([&] {
            parse_scene(
                R"({"bodies": [{"body": "a.h5"}], "obstacles": [{"recording": {)" + recording + "}}]}", "");
        });
    };
    EXPECT_EQ(complaint(R"("body": "bar.h5")"), "obstacles[0].recording.file: is missing");
    EXPECT_EQ(complaint(R"("file": "run.h5")"), "obstacles[0].recording.body: is missing");
    EXPECT_EQ(complaint(R"("file": "run.h5", "body": "bar.h5", "speed": 0)"),
              "obstacles[0].recording.speed: is 0, but must be between 1e-30 and 1e30");
    EXPECT_EQ(complaint(R"("file": "run.h5", "body": "bar.h5", "trajectory": -1)"),
              "obstacles[0].recording.trajectory: is -1, but must be between 0 and 1000000000");
}

}  // namespace
}  // namespace nbd
