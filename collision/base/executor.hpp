#pragma once

#include <functional>

namespace nbd {

/// Runs independent tasks: calls task(0) to task(count - 1) once each, in any order and from any threads, and
/// returns when all are done. The library has no threads of its own. An executor that uses TBB:
///     [](int count, const std::function<void(int)>& task) { tbb::parallel_for(0, count, task); }
using Executor = std::function<void(int count, const std::function<void(int)>& task)>;

/// Runs all tasks in order on the caller's thread.
inline void run_in_order(int count, const std::function<void(int)>& task) {
    for (int i = 0; i < count; ++i) task(i);
}

}  // namespace nbd
