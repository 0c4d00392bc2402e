// Reactions in tables and recordings of a run.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/apps/small_files.hpp"
#include "training/files/recording.hpp"

namespace nbd::test {
namespace {

using Reactions = BoxFolder;

/// A pinned box, and one that falls onto the floor; far from zero.
void write_scene(const std::string& name, const auto& write) {
    write(name, R"({
        "bodies": [{"body": "box.h5", "name": "held, \"up\"", "transform": {"translate": [1000, 0, 0.5]},
                    "pins": [{"box": {"min": [900, -1, 0.5], "max": [1100, 1, 1]}}]},
                   {"body": "box.h5", "name": "free", "transform": {"translate": [1000, 0, 0.055]}}],
        "obstacles": [{"name": "floor", "plane": {}}],
        "time": {"dt": 0.008, "frames": 10, "steps_per_frame": 2}})");
}

TEST_F(Reactions, OfTheRecordingAreThoseOfTheTable) {
    write_scene("scene.json", write);
    make("simulate scene.json -o run.h5 --reactions forces.csv -q");
    const std::vector<std::string> table = lines(bytes("forces.csv"));
    const RecordingReader recording(folder() / "run.h5");
    const std::vector<RecordedReaction> rows = recording.reactions();
    ASSERT_GT(rows.size(), 15u);
    ASSERT_EQ(table.size(), rows.size() + 1);
    EXPECT_EQ(table[0],
              "frame,time,body,kind,by,force_x,force_y,force_z,torque_x,torque_y,torque_z,pressure,volume,"
              "point_x,point_y,point_z");
    int on_floor = 0;
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const RecordedReaction& row = rows[i];
        std::string line = fmt::format("{},{:.9g},{},{},{}", row.frame, row.time,
                                       row.body == 0 ? R"("held, ""up""")" : "free", row.kind, row.by);
        for (const Eigen::Vector3d& vector : {row.force, row.torque})
            line += fmt::format(",{:.9g},{:.9g},{:.9g}", vector[0], vector[1], vector[2]);
        line += fmt::format(",,,{:.9g},{:.9g},{:.9g}", row.point[0], row.point[1], row.point[2]);
        EXPECT_EQ(table[i + 1], line);
        EXPECT_NEAR(row.point.x(), 1000, 0.25) << "in the scene's coordinates";
        on_floor += row.by == "floor";
    }
    EXPECT_GT(on_floor, 1);
    EXPECT_EQ(rows.back().frame, 10);
    make("inspect --check run.h5 -q");
}

TEST_F(Reactions, StayInARecordingThatIsRemapped) {
    write_scene("scene.json", write);
    make("simulate scene.json -o whole.h5 -q");
    make("mesh box.obj -o finer.h5 --elements linear --subdivide 1 -q");
    make("remap whole.h5 --from box.h5 --to finer.h5 -o remapped.h5 --trajectories 1 -q");
    std::vector<RecordedReaction> wanted = RecordingReader(folder() / "whole.h5").reactions();
    std::erase_if(wanted, [](const RecordedReaction& row) { return row.body != 0; });
    ASSERT_FALSE(wanted.empty());
    EXPECT_EQ(RecordingReader(folder() / "remapped.h5").reactions(), wanted);
}

}  // namespace
}  // namespace nbd::test
