#include "tests/fuzz/memory_meter.hpp"

#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#define NBD_METERS_MEMORY
#endif
#elif defined(__SANITIZE_ADDRESS__)
#define NBD_METERS_MEMORY
#endif

#ifdef NBD_METERS_MEMORY
#include <algorithm>
#include <atomic>

// Of the sanitizer's allocator. g++ comes without the header that declares them.
extern "C" {
int __sanitizer_install_malloc_and_free_hooks(void (*allocated)(const volatile void*, std::size_t),
                                              void (*freed)(const volatile void*));
std::size_t __sanitizer_get_current_allocated_bytes();
}
#endif

namespace nbd::test {

#ifdef NBD_METERS_MEMORY

namespace {

constexpr std::size_t large_block = 4096;
constexpr unsigned small_blocks_between_counts = 64;

std::atomic<std::size_t> most_allocated = 0;
std::atomic<unsigned> small_blocks = 0;

void count_block(const volatile void*, std::size_t size) {
    if (size < large_block && small_blocks++ % small_blocks_between_counts != 0) return;
    const std::size_t now = __sanitizer_get_current_allocated_bytes();
    std::size_t most = most_allocated;
    while (now > most && !most_allocated.compare_exchange_weak(most, now)) {
    }
}

void ignore_block(const volatile void*) {}

}  // namespace

MemoryMeter::MemoryMeter() {
    [[maybe_unused]] static const int installed =
        __sanitizer_install_malloc_and_free_hooks(count_block, ignore_block);
    before_ = most_allocated = __sanitizer_get_current_allocated_bytes();
}

std::size_t MemoryMeter::most() const { return most_allocated - std::min(most_allocated.load(), before_); }

#else

MemoryMeter::MemoryMeter() : before_(0) {}

std::size_t MemoryMeter::most() const { return before_; }

#endif

}  // namespace nbd::test
