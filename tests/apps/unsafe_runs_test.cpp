// What a scene or a tree of somebody else must not do without being asked.
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/apps/small_files.hpp"
#include "tests/support/file_damage.hpp"

namespace nbd::test {
namespace {

using UnsafeRuns = SmallFiles;

TEST_F(UnsafeRuns, ScenesCannotWriteOutsideOfTheRecordingsFolder) {
    const std::filesystem::path root = std::filesystem::weakly_canonical(folder());
    std::filesystem::create_directories(root / "inner/sub");
    std::filesystem::create_directory_symlink(root, root / "inner/link");
    write("victim.csv", "precious");
    const auto scene = [](const std::string& name, const std::string& output) {
        write(name, R"({"bodies": [{"body": "box.h5"}], "time": {"frames": 1}, "output": {)" + output + "}}");
        return "simulate " + name + " -q";
    };
    const std::string recording = " -o inner/x.h5";
    const auto outside = [&](const std::string& path, const std::string& name) {
        return path + ": cannot be written: it is outside of " + (root / "inner").string() +
               ", the recording's folder, but " + name +
               " names it as output; allowed: a path within it, or --allow-outside";
    };
    const auto climbing = scene("climbing.json", R"("csv": "../victim.csv")");
    const std::string absolute = (root / "victim.csv").string();
    expect_refused({
        {climbing + recording, 1, outside("inner/../victim.csv", "climbing.json")},
        {scene("hidden.json", R"("obj": "sub/../../frames")") + recording, 1,
         outside("inner/../frames", "hidden.json")},
        {scene("absolute.json", R"("csv": ")" + absolute + '"') + recording, 1,
         outside(absolute, "absolute.json")},
        {scene("linked.json", R"("csv": "link/victim.csv")") + recording, 1,
         outside("inner/link/victim.csv", "linked.json")},
        {scene("recording.json", R"("recording": "../x.h5")"), 1,
         "../x.h5: cannot be written: it is outside of " + root.string() +
             ", the working directory, but recording.json names it as output; allowed: a path within it, or "
             "--allow-outside"},
    });
    EXPECT_EQ(read_bytes(root / "victim.csv"), "precious");
    make(scene("good_paths.json", R"("csv": "sub/../run.csv", "vtu": "sub/vtu")") + recording);
    EXPECT_TRUE(std::filesystem::exists(root / "inner/run.csv"));
    make(climbing + recording + " --allow-outside");
    EXPECT_NE(read_bytes(root / "victim.csv"), "precious");
}

TEST_F(UnsafeRuns, LearnedBoundsWithoutCalibrationNeedAMargin) {
    const auto advice = [](const std::string& bounds) {
        return "the tree's \"" + bounds +
               "\" bounds are not calibrated, so that nodes miss at no stated rate; run `nbdtree calibrate` "
               "on the tree, or give a margin (--margin)";
    };
    write("uncalibrated.json", R"({"bodies": [{"body": "box.h5", "tree": "tree.h5", "bounds": "nbd"},
        {"body": "box.h5", "tree": "tree.h5", "bounds": "nbd", "transform": {"translate": [1, 0, 0]}}],
        "time": {"frames": 1}})");
    const std::string pose = "tree.h5@data.h5:0:";
    const auto collide = [&](const std::string& bounds) {
        return "collide " + pose + "3 " + pose + "9 --bounds " + bounds;
    };
    std::vector<Refusal> refused;
    for (const std::string bounds : {"nbd", "bd", "learned_affine"}) {
        refused.push_back({collide(bounds), 1, advice(bounds)});
        refused.push_back({"view " + pose + "3 --bounds " + bounds + " -o x.html", 1, advice(bounds)});
    }
    refused.push_back({"simulate uncalibrated.json -o x.h5", 1, "bodies[0] (box): " + advice("nbd")});
    refused.push_back({"race uncalibrated.json --bounds nbd", 1, "bodies[0] (box): " + advice("nbd")});
    expect_refused(refused);
    for (const char* bounds : {"nbd --margin 0.1", "learned_affine --margin 0.1", "auto", "boxes"})
        make(collide(bounds) + " -q");
    make("simulate uncalibrated.json -o margin.h5 --margin 0.1 -q");
    make("evaluate tree.h5 data.h5 -q");  // tells of bounds at the margins that it is given
}

}  // namespace
}  // namespace nbd::test
