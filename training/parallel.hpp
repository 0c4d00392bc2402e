#pragma once

#include <functional>

namespace nbd {

/// Runs body(0) .. body(count - 1), each once, in any order, on `threads` threads (0: all cores). Each call
/// writes its own slot, so that results do not depend on the number of threads. Rethrows what a body throws.
void parallel_for(int count, int threads, const std::function<void(int)>& body);

}  // namespace nbd
