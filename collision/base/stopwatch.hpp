#pragma once

#include <chrono>

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

}  // namespace nbd
