#include <gtest/gtest.h>

#include <chrono>
#include <regex>
#include <thread>

#include "tests/apps/small_files.hpp"
#include "tests/apps/terminal.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/meshing/surface_files.hpp"

namespace nbd::test {
namespace {

class ProgressTest : public SmallFiles {
 protected:
    static void SetUpTestSuite() {
        SmallFiles::SetUpTestSuite();
        write("endless.json", R"({"bodies": [{"body": "box.h5"}], "time": {"frames": 1000000}})");
        write("fine.obj", obj_file(box(0.4, 0.1, 0.1, 60)));
    }

    /// The control sequences of a text, without those that erase a line.
    static std::string sequences(std::string text) {
        text = std::regex_replace(text, std::regex("\r\033\\[K"), "");
        return text.find('\033') == std::string::npos ? "" : text.substr(text.find('\033'), 20);
    }

    /// Runs a command on a terminal until it shows `line`, presses Ctrl-C, and returns all that was printed.
    static std::string interrupted_at(const std::string& line, const std::vector<std::string>& arguments) {
        TerminalRun run(folder(), arguments);
        EXPECT_TRUE(run.wait_for(line)) << run.printed();
        run.press_ctrl_c();
        EXPECT_EQ(run.wait(), 130) << run.printed();
        return run.printed();
    }
};

TEST_F(ProgressTest, ShowsABarWithTheTimeLeftOnATerminal) {
    const std::string text = interrupted_at(" left", {"simulate", "endless.json", "-o", "bar.h5"});
    EXPECT_TRUE(std::regex_search(
        text, std::regex("\r\033\\[Kframes \\[[#-]{20}\\] [0-9]+/1000000, [0-9]+:[0-9]{2} left")))
        << text;
    EXPECT_EQ(sequences(text), "");
    // Ctrl-C erases the bar and says what is kept.
    EXPECT_TRUE(
        std::regex_search(text, std::regex("\r\033\\[K[^\n]*stopping as soon as what was begun is complete; "
                                           "Ctrl-C again stops at once\r\n")))
        << text;
    EXPECT_TRUE(std::regex_search(
        text,
        std::regex("nbdtree: error: interrupted: bar.h5 holds the [0-9]+ of 1000000 frames done; continue "
                   "with: .*nbdtree simulate endless.json -o bar.h5 --resume\r\n$")))
        << text;
}

TEST_F(ProgressTest, SaysHowLongWorkWithoutCountedStepsHasTaken) {
    const std::string text = interrupted_at(" so far", {"mesh", "fine.obj", "-o", "fine.h5"});
    EXPECT_TRUE(std::regex_search(text, std::regex("\\[K[a-z ]+.*, 0:[0-9]{2} so far"))) << text;
    EXPECT_NE(text.find("nbdtree: error: interrupted: nothing was written; the same command starts anew\r\n"),
              std::string::npos)
        << text;
}

TEST_F(ProgressTest, EveryLongCommandShowsWhereItIs) {
    make({"mesh", "box.obj", "-o", "fine_box.h5", "--subdivide", "2", "-q"});
    make({"modes", "fine_box.h5", "-m", "8", "-q"});
    make({"remap", "data.h5", "--from", "box.h5", "--to", "fine_box.h5", "-o", "fine_data.h5", "-q"});
    std::vector<std::string> figures{"figures", "-o", "drawn"};
    for (int i = 0; i < 200; ++i)
        for (const std::string& word :
             {std::string("--body"), "B" + std::to_string(i), std::string("tree.h5"), std::string("data.h5")})
            figures.push_back(word);
    const std::vector<std::pair<std::string, std::vector<std::string>>> commands = {
        {"trajectories [", {"dataset", "box.h5", "-o", "more.h5", "--trajectories", "100000"}},
        {"networks [",
         {"train", "fine_box.h5", "fine_data.h5", "-o", "t.h5", "--bounds", "nbd", "-k", "16", "--epochs",
          "200000", "--held-out", "0", "--calibration", "0", "--depth", "8", "--threads", "1"}},
        {" of 200, ", figures},
        {"misses, contact scenes [",
         {"coverage", "tree.h5", "data.h5", "--bounds", "exact", "--contacts", "1000000"}},
        {"frames [", {"race", "endless.json"}},
    };
    for (const auto& [line, arguments] : commands) {
        SCOPED_TRACE(arguments.front());
        EXPECT_EQ(sequences(interrupted_at(line, arguments)), "");
    }
}

TEST_F(ProgressTest, FitsANarrowTerminal) {
    TerminalRun run(folder(), {"simulate", "endless.json", "-o", "narrow.h5"}, 30);
    ASSERT_TRUE(run.wait_for("frames ["));
    run.press_ctrl_c();
    run.wait();
    const std::regex line("\r\033\\[K(frames[^\r\n]*)");
    auto shown = std::sregex_iterator(run.printed().begin(), run.printed().end(), line);
    ASSERT_NE(shown, std::sregex_iterator());
    for (; shown != std::sregex_iterator(); ++shown) EXPECT_LT((*shown)[1].length(), 30) << (*shown)[1];
}

TEST_F(ProgressTest, IsSilentWhereItIsNotWanted) {
    const auto printed = [](const std::vector<std::string>& options, const char* kind) {
        std::vector<std::string> arguments{"race", "endless.json"};
        arguments.insert(arguments.end(), options.begin(), options.end());
        TerminalRun run(folder(), arguments, 80, kind);
        std::this_thread::sleep_for(std::chrono::seconds(2));  // longer than a bar takes to appear
        run.press_ctrl_c();
        EXPECT_EQ(run.wait(), 130);
        return run.printed();
    };
    EXPECT_NE(printed({}, "xterm").find("frames ["), std::string::npos);
    for (const char* option : {"--quiet", "--json"})
        EXPECT_EQ(printed({option}, "xterm").find("frames ["), std::string::npos) << option;
    EXPECT_EQ(printed({}, "dumb").find("frames ["), std::string::npos);  // cannot erase a line
}

TEST_F(ProgressTest, IsSilentWhereStandardErrorIsNoTerminal) {
    Running running(folder(), {"race", "endless.json"});
    running.wait_until_at_work();
    std::this_thread::sleep_for(std::chrono::seconds(2));
    running.interrupt();
    const Ran ran = running.wait();
    EXPECT_TRUE(
        std::regex_match(ran.err, std::regex("nbdtree: error: interrupted: endless.json: [0-9]+ of 1000000 "
                                             "frames done; nothing was written, the same command starts "
                                             "anew\n")))
        << ran.err;
}

TEST_F(ProgressTest, ResultsOnATerminalHaveNoColours) {
    for (const std::vector<std::string>& arguments : {std::vector<std::string>{"inspect", "tree.h5"},
                                                      {"evaluate", "tree.h5", "data.h5"},
                                                      {"--help"},
                                                      {},
                                                      {"mesh"}}) {
        TerminalRun run(folder(), arguments);
        run.wait();
        EXPECT_NE(run.printed(), "");
        EXPECT_EQ(sequences(run.printed()), "");
    }
}

}  // namespace
}  // namespace nbd::test
