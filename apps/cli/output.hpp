#pragma once

#include <fmt/core.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace nbd {

/// Where a command's words go. Text on stdout for people, one JSON object on stdout with --json, progress
/// on stderr: a bar that redraws itself on a terminal, a plain line now and then elsewhere.
class Output {
 public:
    bool quiet = false;
    bool json = false;
    std::string command_line;  // as typed, for a shell

    /// A line or a table for people; nothing with --quiet or --json.
    void text(std::string_view line) const;

    /// A line that must not be lost: stderr, always.
    void warning(std::string_view line) const;

    /// The machine-readable result; printed with --json alone.
    void result(const nlohmann::ordered_json& value) const;

    /// done of total steps of `what`, with an estimate of the time left. Call as often as you like; the first
    /// call says what was done before.
    void progress(std::string_view what, double done, double total, std::string_view note = {});

    /// Leaves a bar that has not reached its end, so that what follows stands on a line of its own.
    void end_progress() const;

 private:
    using Clock = std::chrono::steady_clock;
    std::string what_;
    Clock::time_point started_, last_;
    double done_before_ = 0;            // when the work on what_ began
    mutable bool bar_is_open_ = false;  // the terminal's line is not at its end
};

/// 75 -> "1:15".
std::string minutes(double seconds);

}  // namespace nbd
