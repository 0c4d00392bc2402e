#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace nbd::test {

/// Result of a run of `nbdtree`.
struct Ran {
    int status = 0;  // exit status; minus the signal number if a signal killed it
    std::string out, err;
};

/// Variables of the environment, beside those of the test. NBDTREE_AT makes a run act at a state that it
/// comes to, see apps/cli/test_points.hpp.
using Environment = std::map<std::string, std::string>;

/// The words of a command line, divided at spaces; '...' is one word, with its spaces.
std::vector<std::string> words(std::string_view line);

/// The lines of a text; the cells of a line of a table (CSV).
std::vector<std::string> lines(const std::string& text);
std::vector<std::string> cells(const std::string& line);

/// Becomes `program`, in `folder`, with the arguments `line`. For a process that was forked for it.
[[noreturn]] void become(const std::filesystem::path& folder, std::string_view line, const char* program,
                         const Environment& environment);

/// A run of `nbdtree`, or of the given program, in the background in `folder`.
class Running {
 public:
    /// interrupted: Ctrl-C has been pressed before the program begins, and comes when it handles it.
    enum class Start { plain, interrupted };

    Running(const std::filesystem::path& folder, std::string_view line, const char* program = NBD_COMMAND,
            Start start = Start::plain, const Environment& environment = {});
    ~Running();
    Running(const Running&) = delete;
    Running& operator=(const Running&) = delete;

    /// Sends Ctrl-C.
    void interrupt() const;
    /// Kills the program immediately, without clean-up.
    void kill() const;
    bool has_ended() const;
    Ran wait();

 private:
    std::string out_, err_;  // file names
    int process_ = -1;
};

/// Runs `nbdtree` with the arguments `line` to its end.
Ran run(const std::filesystem::path& folder, std::string_view line, const Environment& environment = {});

/// Names of the files of a folder, including hidden ones.
std::set<std::string> listing(const std::filesystem::path& folder);

}  // namespace nbd::test
