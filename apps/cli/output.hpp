#pragma once

#include <fmt/core.h>

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace nbd {

class ProgressBar;

/// Output of a command: text on stdout, or one JSON object on stdout with --json; on a terminal, a line on
/// stderr says how far the work is, except with --quiet or --json.
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

    /// Says that long work of this name begins. What libraries tell of their progress belongs to it.
    void work(std::string_view name) const;

    /// Reports `done` of `total` steps of `what`; total 0: not known. May be called often; in the first call,
    /// `done` is the number of steps done before.
    void progress(std::string_view what, double done, double total, std::string_view note = {}) const;

    /// As progress(), of a part of the work that work() named.
    void progress_of_work(std::string_view what, double done, double total) const;

    /// Ends the line that tells of the work.
    void end_progress() const;

 private:
    /// Null where this output says nothing of progress.
    ProgressBar* bar() const;
};

}  // namespace nbd
