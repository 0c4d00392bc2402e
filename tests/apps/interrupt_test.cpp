#include <gtest/gtest.h>

#include "tests/apps/small_files.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/meshing/surface_files.hpp"
#include "tests/support/file_damage.hpp"

namespace nbd::test {
namespace {

using InterruptTest = SmallFiles;

const std::string nothing_written =
    "nbdtree: error: interrupted: nothing was written; the same command starts anew\n";

/// A run that gets Ctrl-C at a state that it comes to, see apps/cli/test_points.hpp.
Ran run_and_interrupt(const std::filesystem::path& folder, const std::vector<std::string>& arguments,
                      const std::string& state) {
    return run(folder, arguments, {{"NBDTREE_AT", state + "|interrupt"}});
}

TEST_F(InterruptTest, EndsACommandWithoutPartialResultsAtOnce) {
    write("fine.obj", obj_file(box(0.4, 0.1, 0.1, 60)));
    const auto before = listing(folder());
    const Ran ran =
        run_and_interrupt(folder(), {"mesh", "fine.obj", "-o", "fine.h5", "-q"}, "points of gmsh|256");
    EXPECT_EQ(ran.status, 130);
    EXPECT_EQ(ran.err, nothing_written);
    EXPECT_EQ(listing(folder()), before);
}

TEST_F(InterruptTest, EveryCommandSaysWhatIsKept) {
    write("still.json", R"({"bodies": [{"body": "box.h5"}]})");
    const auto before = listing(folder());
    const std::vector<std::vector<std::string>> commands = {
        {"mesh", "box.obj", "-o", "x.h5"},
        {"modes", "box.h5", "-m", "16"},
        {"dataset", "box.h5", "-o", "x.h5"},
        {"remap", "data.h5", "--from", "box.h5", "--to", "box.h5", "-o", "x.h5"},
        {"train", "box.h5", "data.h5", "-o", "x.h5"},
        {"calibrate", "tree.h5", "data.h5", "-o", "x.h5"},
        {"evaluate", "tree.h5", "data.h5", "--csv", "x.csv", "--html", "x.html"},
        {"figures", "-o", "x", "--body", "A", "tree.h5", "data.h5"},
        {"transfer", "tree.h5", "box.h5", "-o", "x.h5"},
        {"export", "--flat", "tree.h5", "-o", "x.nbd"},
        {"coverage", "tree.h5", "data.h5", "--csv", "x.csv"},
        {"simulate", "still.json", "-o", "x.h5"},
        {"race", "still.json", "--csv", "x.csv"},
        {"validate", "still.json"},
        {"collide", "box.obj", "box.obj", "--pairs", "x.csv", "--view", "x.html"},
        {"inspect", "data.h5"},
        {"view", "data.h5:0", "--body", "box.h5", "-o", "x.html"},
    };
    for (const std::vector<std::string>& arguments : commands) {
        SCOPED_TRACE(arguments.front());
        // The signal waits since before the program began, so that it comes before any work.
        const Ran ran = Running(folder(), arguments, NBD_COMMAND, Running::Start::interrupted).wait();
        EXPECT_EQ(ran.status, 130);
        EXPECT_EQ(ran.out, "");
        EXPECT_EQ(ran.err, nothing_written);
        EXPECT_EQ(listing(folder()), before);
    }
}

TEST_F(InterruptTest, NamesTheFilesThatAreWritten) {
    const Ran ran = run_and_interrupt(folder(),
                                      {"coverage", "tree.h5", "data.h5", "--bounds", "exact", "--csv",
                                       "rows.csv", "--contacts", "1000", "-q"},
                                      "contact scenes|1");
    EXPECT_EQ(ran.status, 130);
    EXPECT_EQ(ran.err, "nbdtree: error: interrupted: rows.csv: written; the same command starts anew\n");
}

TEST_F(InterruptTest, SaysHowManyBodiesHaveFigures) {
    std::vector<std::string> arguments{"figures", "-o", "drawn", "-q"};
    for (int i = 0; i < 50; ++i)
        for (const std::string& part :
             {std::string("--body"), "B" + std::to_string(i), std::string("tree.h5"), std::string("data.h5")})
            arguments.push_back(part);
    const Ran ran = run_and_interrupt(folder(), arguments, "figures of B3, body 4 of 50|0");
    EXPECT_EQ(ran.status, 130);
    EXPECT_EQ(ran.err,
              "nbdtree: error: interrupted: drawn holds figure 10 of 3 of 50 bodies; the same command "
              "makes all anew\n");
    for (const std::string& name : listing(folder() / "drawn"))
        EXPECT_TRUE(name.starts_with("figure")) << name;
}

TEST_F(InterruptTest, KeepsTheFramesOfASimulation) {
    write("scene.json", R"({"bodies": [{"body": "box.h5"}], "time": {"frames": 1000000}})");
    auto expected = listing(folder());
    expected.insert({"long.h5", "long.h5.journal"});
    const Ran ran =
        run_and_interrupt(folder(), {"simulate", "scene.json", "-o", "long.h5", "-q"}, "frames|3");
    EXPECT_EQ(ran.status, 130);
    EXPECT_EQ(
        ran.err,
        "nbdtree: error: interrupted: long.h5 holds the 3 of 1000000 frames done; continue with: nbdtree "
        "simulate scene.json -o long.h5 -q --resume\n");
    EXPECT_EQ(listing(folder()), expected);
    EXPECT_EQ(run(folder(), {"inspect", "long.h5"}).status, 0);
}

TEST_F(InterruptTest, TrainingResumesToTheSameTree) {
    const auto train = [](const std::string& output) {
        return std::vector<std::string>{
            "train", "box.h5",   "data.h5", "-o",         output, "--depth",       "5", "-m", "8", "-k", "16",
            "-q",    "--epochs", "200",     "--held-out", "0",    "--calibration", "0"};
    };
    make(train("whole.h5"));
    auto expected = listing(folder());
    expected.insert("again.h5.checkpoint");
    const Ran ran = run_and_interrupt(folder(), train("again.h5"), "networks|3");
    EXPECT_EQ(ran.status, 130);
    EXPECT_EQ(ran.err, "nbdtree: error: interrupted: the same command continues from again.h5.checkpoint\n");
    EXPECT_EQ(listing(folder()), expected);

    make(train("again.h5"));
    expected.erase("again.h5.checkpoint");
    expected.insert("again.h5");
    EXPECT_EQ(listing(folder()), expected);
    EXPECT_TRUE(read_bytes(folder() / "again.h5") == read_bytes(folder() / "whole.h5"));
}

}  // namespace
}  // namespace nbd::test
