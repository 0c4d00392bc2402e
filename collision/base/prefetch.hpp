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
    constexpr std::size_t line = 64 / sizeof(T);
    for (std::size_t i = 0; i < array.size(); i += line) prefetch_line(array.data() + i);
}

}  // namespace nbd
