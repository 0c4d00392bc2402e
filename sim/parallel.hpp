#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace nbd {

/// Calls body(i) for i in [0, count) on all threads. Each call must write only its own slots, so that one
/// thread and N give the same bits.
template <class Body>
void parallel_for(int count, Body&& body) {
    constexpr int grain = 512;
    tbb::parallel_for(tbb::blocked_range<int>(0, count, grain), [&](const tbb::blocked_range<int>& range) {
        for (int i = range.begin(); i != range.end(); ++i) body(i);
    });
}

}  // namespace nbd
