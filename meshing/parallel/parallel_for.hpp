#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "meshing/parallel/fork_join.hpp"

namespace nbd {

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
