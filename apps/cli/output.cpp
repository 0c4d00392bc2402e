#include "apps/cli/output.hpp"

#include <unistd.h>

#include <cstdio>
#include <utility>

namespace nbd {

void Output::text(std::string_view line) const {
    if (quiet || json) return;
    end_progress();
    fmt::print("{}\n", line);
}

void Output::warning(std::string_view line) const {
    end_progress();
    fmt::print(stderr, "{}: warning: {}\n", program, line);
}

void Output::announcement(std::string_view line) const {
    end_progress();
    fmt::print(stderr, "{}: {}\n", program, line);
}

void Output::result(const nlohmann::ordered_json& value) const {
    if (json) fmt::print("{}\n", value.dump(2));
}

void Output::progress(std::string_view what, double done, double total, std::string_view note) {
    if (quiet) return;
    const bool terminal = isatty(STDERR_FILENO) != 0;
    const auto now = Clock::now();
    if (what != what_) {
        what_ = what;
        started_ = last_ = now;
        done_before_ = done;
    }
    const bool last = done >= total;
    const std::chrono::duration<double> since = now - last_, elapsed = now - started_;
    if (!last && since.count() < (terminal ? 0.2 : 10.0)) return;
    last_ = now;
    const double now_done = done - done_before_;
    const std::string left =
        last ? fmt::format("{} in all", minutes(elapsed.count()))
             : fmt::format("{} left",
                           now_done > 0 ? minutes(elapsed.count() * (total - done) / now_done) : "?");
    fmt::print(stderr, "{}{}: {:.0f}/{:.0f}, {}{}{}{}", terminal ? "\r\033[K" : "", what, done, total, left,
               note.empty() ? "" : ", ", note, terminal && !last ? "" : "\n");
    std::fflush(stderr);
    bar_is_open_ = terminal && !last;
}

void Output::end_progress() const {
    if (std::exchange(bar_is_open_, false)) fmt::print(stderr, "\n");
}

std::string minutes(double seconds) {
    const long whole = static_cast<long>(seconds + 0.5);
    return fmt::format("{}:{:02}", whole / 60, whole % 60);
}

}  // namespace nbd
