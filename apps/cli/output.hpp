#pragma once

#include <fmt/core.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace nbd {

/// Output of a command: text on stdout, or one JSON object on stdout with --json; progress on stderr, as a
/// bar on a terminal and as occasional plain lines elsewhere.
class Output {
 public:
    bool quiet = false;
    bool json = false;
    std::string program;       // begins warnings
    std::string command_line;  // as typed, quoted for a shell

    /// Prints a line or a table; nothing with --quiet or --json.
    void text(std::string_view line) const;

    /// Prints a warning to stderr, even with --quiet.
    void warning(std::string_view line) const;

    /// Prints what a person needs while the command works to stderr, even with --quiet.
    void announcement(std::string_view line) const;

    /// Prints the machine-readable result; only with --json.
    void result(const nlohmann::ordered_json& value) const;

    /// Reports `done` of `total` steps of `what` and an estimate of the time left. May be called often; in
    /// the first call, `done` is the number of steps done before.
    void progress(std::string_view what, double done, double total, std::string_view note = {});

    /// Ends an unfinished bar, so that later output starts on a new line.
    void end_progress() const;

 private:
    using Clock = std::chrono::steady_clock;
    std::string what_;
    Clock::time_point started_, last_;
    double done_before_ = 0;            // steps done when the work on what_ began
    mutable bool bar_is_open_ = false;  // the terminal shows an unfinished bar
};

/// Minutes and seconds, as in 75 -> "1:15".
std::string minutes(double seconds);

}  // namespace nbd
