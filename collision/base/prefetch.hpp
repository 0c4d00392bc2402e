#pragma once

#include <cstddef>
#include <span>

namespace nbd {

/// Hints that the cache line at this address will be read soon. Any address is allowed.
inline void prefetch_line([[maybe_unused]] const void* address) noexcept {
#ifdef __GNUC__
    __builtin_prefetch(address);
#endif
}

/// Prefetches all cache lines of an array.
template <class T>
void prefetch_lines(std::span<const T> array) noexcept {
    const auto* bytes = reinterpret_cast<const char*>(array.data());
    for (std::size_t i = 0; i < array.size_bytes(); i += 64) prefetch_line(bytes + i);
}

}  // namespace nbd
