#pragma once

#include <fmt/core.h>

#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace nbd {

class ProgressBar;

/// Output of a command: text on stdout, or one JSON object on stdout with --json; on a terminal, a line on
/// stderr says how far the work is, except with --quiet or --json.
class Output {
 public:
    bool quiet = false;
    bool json = false;
    bool strict = false;       // the first warning ends the command
    std::string program;       // begins warnings
    std::string command_line;  // as typed, quoted for a shell

    /// Prints a line or a table; nothing with --quiet or --json.
    void text(std::string_view line) const;

    /// Prints a warning to stderr, even with --quiet, and lists it in result(). With --strict, throws
    /// std::runtime_error with the same line instead. Any thread may call it.
    void warning(std::string_view line) const;

    /// Prints and lists a warning also with --strict, for callers that must not be interrupted. The command
    /// then ends at end_if_strict() at the latest.
    void late_warning(std::string_view line) const;

    /// With --strict, throws std::runtime_error with the first late warning, if there was one.
    void end_if_strict() const;

    /// Prints what a person needs while the command works to stderr, even with --quiet.
    void announcement(std::string_view line) const;

    /// Prints the machine-readable result; only with --json. An object has the warnings so far, too.
    void result(nlohmann::ordered_json value) const;

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
    /// What was warned of so far; copies of an output share it.
    struct Warnings {
        std::mutex mutex;
        std::vector<std::string> lines;
        std::string late;  // the first late one; empty: none
    };

    /// Null where this output says nothing of progress.
    ProgressBar* bar() const;

    std::shared_ptr<Warnings> warnings_ = std::make_shared<Warnings>();
};

}  // namespace nbd
