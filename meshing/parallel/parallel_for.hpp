#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#if defined(__SANITIZE_THREAD__)
#include <sanitizer/tsan_interface.h>
#endif

#include "collision/base/work_log.hpp"

namespace nbd {

/// Tells the thread's WorkLog and the thread sanitizer the order of a parallel loop: what the caller did
/// before it, then the tasks, then what the caller does after it. The sanitizer does not see that order by
/// itself, because the library of TBB is built without it. Without a log and a sanitizer, does nothing.
class ForkJoin {
 public:
    ForkJoin(const char* file, int line) : log_(work_log()) {
        if (log_) log_->begin_loop(file, line);
        release(fork_);
    }
    ~ForkJoin() {
        acquire(join_);
        if (log_) log_->end_loop();
    }
    ForkJoin(const ForkJoin&) = delete;
    ForkJoin& operator=(const ForkJoin&) = delete;

    class Task {
     public:
        explicit Task(ForkJoin& loop) : loop_(loop) {
            acquire(loop_.fork_);
            if (loop_.log_) loop_.log_->begin_task();
        }
        ~Task() {
            if (loop_.log_) loop_.log_->end_task();
            release(loop_.join_);
        }
        Task(const Task&) = delete;
        Task& operator=(const Task&) = delete;

     private:
        ForkJoin& loop_;
    };

 private:
#if defined(__SANITIZE_THREAD__)
    static void release(char& at) { __tsan_release(&at); }
    static void acquire(char& at) { __tsan_acquire(&at); }
#else
    static void release(char&) {}
    static void acquire(char&) {}
#endif

    WorkLog* log_;
    char fork_ = 0, join_ = 0;
};

/// Calls body(i) once for each i in [0, count), in any order, on the threads of the caller's TBB arena. Each
/// call must write only its own slots, so that one thread and N give the same bits. Rethrows an exception of
/// body. grain: calls per task; use 1 if each call is long, the default for loops over nodes or elements.
/// file, line: the caller's, for a WorkLog.
template <class Body>
void parallel_for(int count, Body&& body, int grain = 512, const char* file = __builtin_FILE(),
                  int line = __builtin_LINE()) {
    ForkJoin loop(file, line);
    tbb::parallel_for(
        tbb::blocked_range<int>(0, count, grain),
        [&](const tbb::blocked_range<int>& range) {
            const ForkJoin::Task task(loop);
            for (int i = range.begin(); i != range.end(); ++i) body(i);
        },
        tbb::simple_partitioner{});
}

}  // namespace nbd
