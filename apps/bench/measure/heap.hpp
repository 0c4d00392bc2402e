#pragma once

#include <malloc.h>

#include <cstddef>

namespace nbd {

/// Bytes that the program has allocated and not freed; 0 if the C library does not report them.
inline std::size_t heap_bytes() {
#if defined(__GLIBC__) && (__GLIBC__ > 2 || __GLIBC_MINOR__ >= 33)
    const struct mallinfo2 info = mallinfo2();
    return info.uordblks + info.hblkhd;
#else
    return 0;
#endif
}

}  // namespace nbd
