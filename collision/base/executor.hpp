#pragma once

#include <functional>

namespace nbd {

/// Runs tasks that do not depend on each other: calls task(0) up to task(count - 1), each once, in any order
/// and from any threads, and returns when all are done. The library has no threads of its own; with TBB, for
/// instance,
///     [](int count, const std::function<void(int)>& task) { tbb::parallel_for(0, count, task); }
using Executor = std::function<void(int count, const std::function<void(int)>& task)>;

/// The caller's thread does it all.
inline void run_in_order(int count, const std::function<void(int)>& task) {
    for (int i = 0; i < count; ++i) task(i);
}

}  // namespace nbd
