// A library to preload (LD_PRELOAD). In every call, real time is another one, up to two days before or after
// the true one. Clocks that only go forward are left alone, and so is fontconfig: it warns of fonts that are
// newer than the clock, and smooths text slightly differently. See surroundings.py.
//   NBD_CLOCK_SEED   number that the jumps depend on
#include <dlfcn.h>
#include <sys/time.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <ctime>

namespace {

constexpr std::int64_t farthest = 2 * 24 * 3600;  // seconds

/// Seconds, from -farthest to farthest, another number in each call.
std::int64_t jump() {
    static std::atomic<std::uint64_t> calls = [] {
        const char* const seed = std::getenv("NBD_CLOCK_SEED");
        return seed ? std::strtoull(seed, nullptr, 10) << 32 : 0;
    }();
    // SplitMix64 (Steele, Lea and Flood 2014)
    std::uint64_t x = ++calls * 0x9e3779b97f4a7c15;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9;
    x = (x ^ (x >> 27)) * 0x94d049bb133111eb;
    return static_cast<std::int64_t>((x ^ (x >> 31)) % (2 * farthest + 1)) - farthest;
}

/// Whether the code at this place must see another time.
bool is_deceived(const void* place) {
    Dl_info object{};
    return dladdr(place, &object) == 0 || !std::strstr(object.dli_fname, "libfontconfig");
}

int true_time(clockid_t clock, timespec* now) {
    static const auto real = reinterpret_cast<decltype(&clock_gettime)>(dlsym(RTLD_NEXT, "clock_gettime"));
    return real(clock, now);
}

/// Real time as the code at this place must see it.
timespec seen_from(const void* caller, clockid_t clock = CLOCK_REALTIME) {
    timespec now{};
    true_time(clock, &now);
    if (is_deceived(caller)) now.tv_sec += jump();
    return now;
}

}  // namespace

#pragma GCC visibility push(default)
extern "C" {

int clock_gettime(clockid_t clock, timespec* now) noexcept {
    if (clock != CLOCK_REALTIME && clock != CLOCK_REALTIME_COARSE) return true_time(clock, now);
    *now = seen_from(__builtin_return_address(0), clock);
    return 0;
}

int gettimeofday(timeval* now, void*) noexcept {
    const timespec precise = seen_from(__builtin_return_address(0));
    *now = {precise.tv_sec, precise.tv_nsec / 1000};
    return 0;
}

std::time_t time(std::time_t* result) noexcept {
    const timespec precise = seen_from(__builtin_return_address(0));
    if (result) *result = precise.tv_sec;
    return precise.tv_sec;
}

}  // extern "C"
#pragma GCC visibility pop
