#include <gtest/gtest.h>

#include <chrono>
#include <regex>
#include <thread>

#include "tests/apps/small_files.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/meshing/surface_files.hpp"
#include "tests/support/file_damage.hpp"

namespace nbd::test {
namespace {

using InterruptTest = SmallFiles;

/// Sends Ctrl-C after the command has worked for `patience`.
Ran run_and_interrupt(const std::filesystem::path& folder, const std::vector<std::string>& arguments,
                      std::chrono::milliseconds patience = std::chrono::milliseconds(700)) {
    Running running(folder, arguments);
    running.wait_until_at_work();
    std::this_thread::sleep_for(patience);
    running.interrupt();
    return running.wait();
}

TEST_F(InterruptTest, EndsACommandWithoutPartialResultsAtOnce) {
    write("fine.obj", obj_file(box(0.4, 0.1, 0.1, 60)));
    const auto before = listing(folder());
    const Ran ran = run_and_interrupt(folder(), {"mesh", "fine.obj", "-o", "fine.h5", "-q"},
                                      std::chrono::milliseconds(0));
    EXPECT_EQ(ran.status, 130);
    EXPECT_EQ(ran.err, "nbdtree: error: interrupted\n");
    EXPECT_EQ(listing(folder()), before);
}

TEST_F(InterruptTest, KeepsTheFramesOfASimulation) {
    write("scene.json", R"({"bodies": [{"body": "box.h5"}], "time": {"frames": 1000000}})");
    auto expected = listing(folder());
    expected.insert({"long.h5", "long.h5.journal"});
    const Ran ran = run_and_interrupt(folder(), {"simulate", "scene.json", "-o", "long.h5", "-q"});
    EXPECT_EQ(ran.status, 130);
    EXPECT_TRUE(std::regex_match(
        ran.err, std::regex("nbdtree: error: interrupted: long.h5 holds the [0-9]+ of 1000000 frames done; "
                            "continue with: nbdtree simulate scene.json -o long.h5 -q --resume\n")))
        << ran.err;
    EXPECT_EQ(listing(folder()), expected);
    EXPECT_EQ(run(folder(), {"inspect", "long.h5"}).status, 0);
}

TEST_F(InterruptTest, TrainingResumesToTheSameTree) {
    const auto train = [](const std::string& output) {
        return std::vector<std::string>{
            "train", "box.h5",   "data.h5", "-o",         output, "--depth",       "5", "-m", "8", "-k", "16",
            "-q",    "--epochs", "2000",    "--held-out", "0",    "--calibration", "0"};
    };
    make(train("whole.h5"));
    auto expected = listing(folder());
    expected.insert("again.h5.checkpoint");
    auto on_one_thread = train("again.h5");  // slow enough to be still running when Ctrl-C arrives
    on_one_thread.insert(on_one_thread.end(), {"--threads", "1"});
    Ran ran;
    // Slow builds may have trained nothing when Ctrl-C arrives; the message then says so.
    for (auto wait = std::chrono::milliseconds(200); wait < std::chrono::seconds(10); wait *= 2) {
        ran = run_and_interrupt(folder(), on_one_thread, wait);
        if (ran.err != "nbdtree: error: interrupted: nothing has been trained yet\n") break;
    }
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
