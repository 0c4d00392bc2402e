#pragma once

#include <cstddef>
#include <span>

namespace nbd {

/// Has the cache bring the line at an address, whatever it is: never a fault, and no more than a hint.
inline void prefetch_line([[maybe_unused]] const void* address) noexcept {
#ifdef __GNUC__
    __builtin_prefetch(address);
#endif
}

/// Likewise all lines of an array.
template <class T>
void prefetch_lines(std::span<const T> array) noexcept {
    constexpr std::size_t line = 64 / sizeof(T);
    for (std::size_t i = 0; i < array.size(); i += line) prefetch_line(array.data() + i);
}

}  // namespace nbd
