#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#if defined(__SANITIZE_THREAD__)
#include <sanitizer/tsan_interface.h>
#endif

namespace nbd {

/// Tells the thread sanitizer the order of a parallel loop: what the caller did before it, then the tasks,
/// then what the caller does after it. The sanitizer does not see that order by itself, because the library
/// of TBB is built without it. Does nothing in other builds.
class ForkJoin {
 public:
#if defined(__SANITIZE_THREAD__)
    ForkJoin() { __tsan_release(&fork_); }
    void begin_task() { __tsan_acquire(&fork_); }
    void end_task() { __tsan_release(&join_); }
    void join() { __tsan_acquire(&join_); }

 private:
    char fork_ = 0, join_ = 0;
#else
    void begin_task() {}
    void end_task() {}
    void join() {}
#endif
};

/// Calls body(i) once for each i in [0, count), in any order, on the threads of the caller's TBB arena. Each
/// call must write only its own slots, so that one thread and N give the same bits. Rethrows an exception of
/// body. grain: calls per task; use 1 if each call is long, the default for loops over nodes or elements.
template <class Body>
void parallel_for(int count, Body&& body, int grain = 512) {
    ForkJoin order;
    tbb::parallel_for(
        tbb::blocked_range<int>(0, count, grain),
        [&](const tbb::blocked_range<int>& range) {
            order.begin_task();
            for (int i = range.begin(); i != range.end(); ++i) body(i);
            order.end_task();
        },
        tbb::simple_partitioner{});
    order.join();
}

}  // namespace nbd
