#pragma once

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

namespace nbd::test {

/// Result of `work` with `threads` threads in its parallel loops, regardless of the number of cores.
template <class Work>
auto on_threads(int threads, Work&& work) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    tbb::task_arena arena(threads);
    return arena.execute(work);
}

}  // namespace nbd::test
