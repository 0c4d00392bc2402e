#include "apps/cli/progress_bar.hpp"

#include <fmt/core.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "apps/cli/interrupt.hpp"

namespace nbd {
namespace {

constexpr auto patience = std::chrono::seconds(1);  // work that takes less is not shown
constexpr auto pause = std::chrono::milliseconds(200);
constexpr double worth_telling = 2;  // seconds

bool can_erase_lines() {
    const char* const kind = std::getenv("TERM");
    return isatty(STDERR_FILENO) != 0 && kind && *kind && std::string_view(kind) != "dumb";
}

/// Columns of the terminal; 80 where it does not say.
std::size_t columns() {
    winsize size{};
    const bool is_known = ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
    return is_known ? size.ws_col : 80;
}

std::string bar(double share) {
    constexpr std::size_t width = 20;
    const std::size_t full = std::clamp(share, 0.0, 1.0) * width;
    return std::string(full, '#') + std::string(width - full, '-');
}

}  // namespace

ProgressBar::~ProgressBar() { end(); }

void ProgressBar::start(std::string_view what, double done) {
    what_ = what;
    note_.clear();
    started_ = Clock::now();
    done_before_ = done;
    is_counted_ = false;
    if (redraws_.joinable()) return;
    begun_ = last_ = started_;
    redraws_ = std::jthread([this](const std::stop_token& stop) {
        std::unique_lock lock(mutex_);
        while (!wake_.wait_for(lock, stop, pause, [] { return false; }) && !stop.stop_requested())
            if (!what_.empty() && Clock::now() - last_ >= pause) draw();
    });
}

void ProgressBar::begin(std::string_view work) {
    const std::lock_guard lock(mutex_);
    work_ = work;
    start(work, 0);
    work_started_ = started_;
}

void ProgressBar::count(std::string_view what, double done, double total, std::string_view note) {
    const std::lock_guard lock(mutex_);
    work_.clear();
    update(what, done, total, note);
}

void ProgressBar::count_part(std::string_view what, double done, double total) {
    const std::lock_guard lock(mutex_);
    update(work_.empty() ? std::string(what) : fmt::format("{}, {}", work_, what), done, total, {});
}

void ProgressBar::update(std::string_view what, double done, double total, std::string_view note) {
    if (what != what_) start(what, done);
    is_counted_ = true;
    done_ = done;
    total_ = total;
    note_ = note;
    const std::chrono::duration<double> elapsed = Clock::now() - started_;
    if (total > 0 && done >= total) {
        clear();
        if (work_.empty() && elapsed.count() >= worth_telling)
            fmt::print(stderr, "{}: {:.0f} in {}\n", what_, total, minutes(elapsed.count()));
        what_ = work_;
        started_ = work_started_;
        is_counted_ = false;
    } else if (Clock::now() - last_ >= pause) {
        draw();
    }
}

std::string ProgressBar::text() const {
    const double seconds = std::chrono::duration<double>(Clock::now() - started_).count();
    if (!is_counted_) return fmt::format("{}, {} so far", what_, minutes(seconds));
    if (total_ <= 0) return fmt::format("{}: {:.0f}, {} so far", what_, done_, minutes(seconds));
    const double fresh = done_ - done_before_;
    return fmt::format("{} [{}] {:.0f}/{:.0f}, {} left{}{}", what_, bar(done_ / total_), done_, total_,
                       fresh > 0 ? minutes(seconds * (total_ - done_) / fresh) : "?",
                       note_.empty() ? "" : ", ", note_);
}

void ProgressBar::draw() {
    const auto now = Clock::now();
    if (now - begun_ < patience) return;
    last_ = now;
    is_drawn_ = true;
    clear_line_on_interrupt(true);
    fmt::print(stderr, "\r\033[K{}", text().substr(0, columns() - 1));
    std::fflush(stderr);
}

void ProgressBar::clear() {
    last_ = Clock::now();
    if (!is_drawn_) return;
    is_drawn_ = false;
    fmt::print(stderr, "\r\033[K");
    std::fflush(stderr);
    clear_line_on_interrupt(false);
}

void ProgressBar::erase() {
    const std::lock_guard lock(mutex_);
    clear();
}

void ProgressBar::end() {
    {
        const std::lock_guard lock(mutex_);
        clear();
        what_.clear();
        work_.clear();
    }
    redraws_ = {};
}

ProgressBar* progress_bar() {
    static const bool is_terminal = can_erase_lines();
    if (!is_terminal) return nullptr;  // and takes no memory, since what ran out of it also asks
    static ProgressBar bar;
    return &bar;
}

std::string minutes(double seconds) {
    const long whole = seconds + 0.5;
    return fmt::format("{}:{:02}", whole / 60, whole % 60);
}

}  // namespace nbd
