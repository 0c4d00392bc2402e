#include <gtest/gtest.h>
#include <poll.h>
#include <pty.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <regex>
#include <stdexcept>

#include "tests/apps/small_files.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/meshing/surface_files.hpp"

namespace nbd::test {
namespace {

/// A run of `nbdtree` with a terminal as standard error and output, in the background in `folder`.
class TerminalRun {
 public:
    TerminalRun(const std::filesystem::path& folder, std::string_view line, int columns = 80,
                const char* kind = "xterm", const Environment& environment = {});
    ~TerminalRun();
    TerminalRun(const TerminalRun&) = delete;
    TerminalRun& operator=(const TerminalRun&) = delete;

    /// Reads until the program has printed `text`; false if it ended without, or hangs for ten minutes.
    bool wait_for(const std::string& text);
    /// Presses Ctrl-C in the terminal.
    void press_ctrl_c();
    /// Reads what is left. Returns the exit status; minus the signal number if a signal killed it.
    int wait();
    /// All that was printed so far, with carriage returns and control sequences.
    const std::string& printed() const { return printed_; }

 private:
    bool read_some();

    std::string printed_;
    int terminal_ = -1, process_ = -1;
};

TerminalRun::TerminalRun(const std::filesystem::path& folder, std::string_view line, int columns,
                         const char* kind, const Environment& environment) {
    const winsize size{
        .ws_row = 24, .ws_col = static_cast<unsigned short>(columns), .ws_xpixel = 0, .ws_ypixel = 0};
    process_ = forkpty(&terminal_, nullptr, nullptr, &size);
    if (process_ < 0) throw std::runtime_error("cannot open a terminal");
    if (process_ > 0) return;
    termios settings{};
    tcgetattr(STDIN_FILENO, &settings);
    settings.c_lflag &= ~static_cast<tcflag_t>(ECHO);  // Ctrl-C shows nothing
    tcsetattr(STDIN_FILENO, TCSANOW, &settings);
    setenv("TERM", kind, 1);
    become(folder, line, NBD_COMMAND, environment);
}

TerminalRun::~TerminalRun() {
    if (process_ > 0) {
        kill(process_, SIGKILL);
        waitpid(process_, nullptr, 0);
    }
    close(terminal_);
}

bool TerminalRun::read_some() {
    std::array<char, 4096> bytes;
    const ssize_t n = read(terminal_, bytes.data(), bytes.size());  // fails when the program has ended
    if (n > 0) printed_.append(bytes.data(), n);
    return n > 0;
}

bool TerminalRun::wait_for(const std::string& text) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(10);
    while (printed_.find(text) == std::string::npos) {
        pollfd waiting{terminal_, POLLIN, 0};
        if (std::chrono::steady_clock::now() > end || (poll(&waiting, 1, 1000) > 0 && !read_some()))
            return false;
    }
    return true;
}

void TerminalRun::press_ctrl_c() {
    constexpr char ctrl_c = 3;
    if (write(terminal_, &ctrl_c, 1) != 1) throw std::runtime_error("cannot write to the terminal");
}

int TerminalRun::wait() {
    while (read_some()) {
    }
    int status = 0;
    waitpid(process_, &status, 0);
    process_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

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

    /// Runs a command on a terminal, which stays at a state of its work, see apps/cli/test_points.hpp, until
    /// it shows `line`; presses Ctrl-C, and returns all that was printed.
    static std::string interrupted_at(const std::string& line, const std::string& state,
                                      const std::string& command, int columns = 80) {
        TerminalRun run(folder(), command, columns, "xterm", {{"NBDTREE_AT", state + "|wait|never"}});
        EXPECT_TRUE(run.wait_for(line)) << run.printed();
        run.press_ctrl_c();
        EXPECT_EQ(run.wait(), 130) << run.printed();
        return run.printed();
    }
};

TEST_F(ProgressTest, ShowsABarWithTheTimeLeftOnATerminal) {
    const std::string text = interrupted_at(" left", "frames|2", "simulate endless.json -o bar.h5");
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
    const std::string text =
        interrupted_at(" so far", "points of gmsh|256", "mesh fine.obj -o fine.h5 --elements linear");
    EXPECT_TRUE(std::regex_search(text, std::regex("\\[K[a-z ]+.*, [0-9]+:[0-9]{2} so far"))) << text;
    EXPECT_NE(text.find("nbdtree: error: interrupted: nothing was written; the same command starts anew\r\n"),
              std::string::npos)
        << text;
}

TEST_F(ProgressTest, EveryLongCommandShowsWhereItIs) {
    make("mesh box.obj -o fine_box.h5 --elements linear --subdivide 2 -q");
    make("modes fine_box.h5 -m 8 -q");
    make("remap data.h5 --from box.h5 --to fine_box.h5 -o fine_data.h5 -q");
    const struct {
        std::string line, state, command;
    } cases[] = {
        {"trajectories [", "trajectories|1", "dataset box.h5 -o more.h5 --trajectories 100000"},
        {"networks [", "networks|1",
         "train fine_box.h5 fine_data.h5 -o t.h5 --bounds nbd -k 16 --epochs 20 --held-out 0 --calibration 0 "
         "--depth 4 --threads 1"},
        {"misses, contact scenes [", "contact scenes|1",
         "coverage tree.h5 data.h5 --bounds exact --contacts 1000"},
        {"frames [", "frames|1", "race endless.json"},
    };
    for (const auto& [line, state, command] : cases) {
        SCOPED_TRACE(command);
        EXPECT_EQ(sequences(interrupted_at(line, state, command)), "");
    }
}

TEST_F(ProgressTest, FitsANarrowTerminal) {
    const std::string text = interrupted_at("frames [", "frames|2", "simulate endless.json -o narrow.h5", 30);
    const std::regex line("\r\033\\[K(frames[^\r\n]*)");
    auto shown = std::sregex_iterator(text.begin(), text.end(), line);
    ASSERT_NE(shown, std::sregex_iterator());
    for (; shown != std::sregex_iterator(); ++shown) EXPECT_LT((*shown)[1].length(), 30) << (*shown)[1];
}

/// For runs to their end, in which every look at the clock takes 50 ms, so that a bar appears soon where one
/// is wanted.
class SilentProgress : public ProgressTest {
 protected:
    void SetUp() override {
        if (slow_clock.empty()) GTEST_SKIP() << "a library for the clock conflicts with sanitizers";
    }

    const std::string slow_clock = NBD_COUNTING_CLOCK;
    const Environment counted{{"LD_PRELOAD", slow_clock}};
    const std::string race = "race endless.json --frames 100 --bounds boxes";
};

TEST_F(SilentProgress, WhereItIsNotWanted) {
    const auto printed = [&](const std::string& option, const char* kind) {
        TerminalRun run(folder(), race + ' ' + option, 80, kind, counted);
        EXPECT_EQ(run.wait(), 0);
        return run.printed();
    };
    EXPECT_NE(printed("", "xterm").find("frames ["), std::string::npos);
    for (const char* option : {"--quiet", "--json"})
        EXPECT_EQ(printed(option, "xterm").find("frames ["), std::string::npos) << option;
    EXPECT_EQ(printed("", "dumb").find("frames ["), std::string::npos);  // cannot erase a line
}

TEST_F(SilentProgress, WhereStandardErrorIsNoTerminal) {
    const Ran ran = run(race, counted);
    EXPECT_EQ(ran.status, 0);
    EXPECT_EQ(ran.err, "");
}

TEST_F(ProgressTest, ResultsOnATerminalHaveNoColours) {
    for (const char* command : {"inspect tree.h5", "evaluate tree.h5 data.h5", "--help", "", "mesh"}) {
        TerminalRun run(folder(), command);
        run.wait();
        EXPECT_NE(run.printed(), "");
        EXPECT_EQ(sequences(run.printed()), "");
    }
}

}  // namespace
}  // namespace nbd::test
