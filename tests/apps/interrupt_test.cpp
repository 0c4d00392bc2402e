#include <gtest/gtest.h>

#include "tests/apps/small_files.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/meshing/surface_files.hpp"

namespace nbd::test {
namespace {

class InterruptTest : public SmallFiles {
 protected:
    /// What a command says that gets Ctrl-C at a state that it comes to, see apps/cli/test_points.hpp.
    static std::string interrupted(const std::string& line, const std::string& state) {
        const Ran ran = run(line, {{"NBDTREE_AT", state + "|interrupt"}});
        EXPECT_EQ(ran.status, 130);
        return ran.err;
    }
};

const std::string nothing_written =
    "nbdtree: error: interrupted: nothing was written; the same command starts anew\n";

TEST_F(InterruptTest, EndsACommandWithoutPartialResultsAtOnce) {
    write("fine.obj", obj_file(box(0.4, 0.1, 0.1, 60)));
    const auto before = listing(folder());
    EXPECT_EQ(interrupted("mesh fine.obj -o fine.h5 --elements linear -q", "points of gmsh|256"),
              nothing_written);
    EXPECT_EQ(listing(folder()), before);
}

TEST_F(InterruptTest, EveryCommandSaysWhatIsKept) {
    write("still.json", R"({"bodies": [{"body": "box.h5"}]})");
    const auto before = listing(folder());
    for (const char* line : {
             "mesh box.obj -o x.h5",
             "modes box.h5 -m 16",
             "dataset box.h5 -o x.h5",
             "remap data.h5 --from box.h5 --to box.h5 -o x.h5",
             "train box.h5 data.h5 -o x.h5",
             "calibrate tree.h5 data.h5 -o x.h5",
             "evaluate tree.h5 data.h5 --csv x.csv",
             "transfer tree.h5 box.h5 -o x.h5",
             "export --flat tree.h5 -o x.nbd",
             "coverage tree.h5 data.h5 --csv x.csv",
             "simulate still.json -o x.h5",
             "race still.json --csv x.csv",
             "validate still.json",
             "collide box.obj box.obj --pairs x.csv --view x.html",
             "inspect data.h5",
             "view data.h5:0 --body box.h5 -o x.html",
         }) {
        SCOPED_TRACE(line);
        // The signal waits since before the program began, so that it comes before any work.
        const Ran ran = Running(folder(), line, NBD_COMMAND, Running::Start::interrupted).wait();
        EXPECT_EQ(ran.status, 130);
        EXPECT_EQ(ran.out, "");
        EXPECT_EQ(ran.err, nothing_written);
        EXPECT_EQ(listing(folder()), before);
    }
}

TEST_F(InterruptTest, NamesTheFilesThatAreWritten) {
    EXPECT_EQ(interrupted("coverage tree.h5 data.h5 --bounds exact --csv rows.csv --contacts 1000 -q",
                          "contact scenes|1"),
              "nbdtree: error: interrupted: rows.csv: written; the same command starts anew\n");
}

TEST_F(InterruptTest, KeepsTheFramesOfASimulation) {
    write("scene.json", R"({"bodies": [{"body": "box.h5"}], "time": {"frames": 1000000}})");
    auto expected = listing(folder());
    expected.insert({"long.h5", "long.h5.journal"});
    EXPECT_EQ(
        interrupted("simulate scene.json -o long.h5 -q", "frames|3"),
        "nbdtree: error: interrupted: long.h5 holds the 3 of 1000000 frames done; continue with: nbdtree "
        "simulate scene.json -o long.h5 -q --resume\n");
    EXPECT_EQ(listing(folder()), expected);
    make("inspect long.h5");
}

TEST_F(InterruptTest, TrainingResumesToTheSameTree) {
    const std::string train =
        "train box.h5 data.h5 --depth 5 -m 8 -k 16 -q --epochs 200 --held-out 0 --calibration 0 -o ";
    make(train + "whole.h5");
    auto expected = listing(folder());
    expected.insert("again.h5.checkpoint");
    EXPECT_EQ(interrupted(train + "again.h5", "networks|3"),
              "nbdtree: error: interrupted: the same command continues from again.h5.checkpoint\n");
    EXPECT_EQ(listing(folder()), expected);

    make(train + "again.h5");
    expected.erase("again.h5.checkpoint");
    expected.insert("again.h5");
    EXPECT_EQ(listing(folder()), expected);
    EXPECT_TRUE(bytes("again.h5") == bytes("whole.h5"));
}

}  // namespace
}  // namespace nbd::test
