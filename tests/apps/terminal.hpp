#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "tests/apps/command.hpp"

namespace nbd::test {

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

}  // namespace nbd::test
