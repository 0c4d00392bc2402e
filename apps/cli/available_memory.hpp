#pragma once

#include <cstdint>

namespace nbd {

/// Bytes of memory that this process may still take: what /proc/meminfo calls available, or the limit of its
/// control group if that is less. The largest number where neither can be read.
std::uint64_t available_memory();

}  // namespace nbd
