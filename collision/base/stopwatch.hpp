#pragma once

#include <chrono>
#include <utility>

#include "collision/base/work_log.hpp"

namespace nbd {

/// Measures the time since its construction.
class Stopwatch {
 public:
    double seconds() const {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    }
    double microseconds() const { return 1e6 * seconds(); }

 private:
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// Adds to a sum the microseconds of its life, without those of the timers that this thread makes meanwhile:
/// each moment counts once, in the innermost timer. A timer with a name is a phase in the thread's WorkLog.
class ScopedTimer {
 public:
    explicit ScopedTimer(double& sum_us, const char* phase = nullptr)
        : sum_us_(sum_us), outer_(std::exchange(innermost(), this)), log_(phase ? work_log() : nullptr) {
        if (log_) log_->begin_phase(phase);
    }
    ~ScopedTimer() {
        if (log_) log_->end_phase();
        const double us = watch_.microseconds();
        sum_us_ += us - inner_us_;
        if (outer_) outer_->inner_us_ += us;
        innermost() = outer_;
    }
    ScopedTimer(const ScopedTimer&) = delete;
    ScopedTimer& operator=(const ScopedTimer&) = delete;

 private:
    static ScopedTimer*& innermost() noexcept {
        static thread_local ScopedTimer* timer = nullptr;
        return timer;
    }

    Stopwatch watch_;
    double& sum_us_;
    double inner_us_ = 0;
    ScopedTimer* outer_;
    WorkLog* log_;
};

/// Returns work(), whose time a ScopedTimer adds to the sum.
template <class Work>
auto timed(double& sum_us, const Work& work) {
    const ScopedTimer timer(sum_us);
    return work();
}
template <class Work>
auto timed(double& sum_us, const char* phase, const Work& work) {
    const ScopedTimer timer(sum_us, phase);
    return work();
}

}  // namespace nbd
