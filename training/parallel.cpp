#include "training/parallel.hpp"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

namespace nbd {

void parallel_for(int count, int threads, const std::function<void(int)>& body) {
    tbb::task_arena arena(threads > 0 ? threads : tbb::task_arena::automatic);
    arena.execute([&] { tbb::parallel_for(0, count, body, tbb::simple_partitioner{}); });
}

}  // namespace nbd
