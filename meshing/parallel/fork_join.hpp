#pragma once

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

}  // namespace nbd
