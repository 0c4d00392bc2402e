#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>

namespace nbd {

/// A line on the terminal behind standard error that says how far the work is: a bar and the time left where
/// steps are counted, else the time so far. It redraws itself, and appears once there has been work for
/// a second, whatever it was.
class ProgressBar {
 public:
    ProgressBar() = default;
    ~ProgressBar();
    ProgressBar(const ProgressBar&) = delete;
    ProgressBar& operator=(const ProgressBar&) = delete;

    /// Work of this name begins; the line shows the time so far until steps are counted.
    void begin(std::string_view work);

    /// `done` of `total` steps of `what`; total 0: not known. Another name begins its own clock; in its first
    /// call, `done` is the number of steps done before.
    void count(std::string_view what, double done, double total, std::string_view note);

    /// As count(), of a part of the work that begin() named.
    void count_part(std::string_view what, double done, double total);

    /// Erases the line, so that other output may follow. It comes back if the work goes on.
    void erase();

    /// Ends the work: erases the line and draws no more.
    void end();

 private:
    using Clock = std::chrono::steady_clock;

    void start(std::string_view what, double done);
    void update(std::string_view what, double done, double total, std::string_view note);
    void draw();
    void clear();
    std::string text() const;

    std::mutex mutex_;
    std::string work_;         // what begin() named; empty: nothing
    std::string what_, note_;  // what is shown; what_ empty: nothing
    double done_before_ = 0, done_ = 0, total_ = 0;
    bool is_counted_ = false, is_drawn_ = false;
    Clock::time_point begun_;  // the first of the works, each of which may be short
    Clock::time_point work_started_, started_, last_;
    std::condition_variable_any wake_;
    std::jthread redraws_;  // while there is work
};

/// That of this process; null where nothing is to be printed.
ProgressBar* progress_bar();

/// Minutes and seconds, as in 75 -> "1:15".
std::string minutes(double seconds);

}  // namespace nbd
