// A library to preload (LD_PRELOAD), which makes the machine look as if it were faster: clocks that only go
// forward advance by a tenth of the time, and sleeps and timeouts last ten times as long, so that ten times
// as much work is done meanwhile. Browsers are left alone. See tests/any_speed.
//   NBD_SPEED   how many times as fast; 10 where it is not set
#include <dlfcn.h>
#include <poll.h>
#include <pthread.h>
#include <semaphore.h>
#include <sys/select.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <ctime>

namespace {

using Nanoseconds = std::int64_t;
constexpr Nanoseconds second = 1'000'000'000;

template <class Function>
Function* next(const char* name) {
    return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

Nanoseconds number_of(const timespec& t) { return t.tv_sec * second + t.tv_nsec; }
timespec time_of(Nanoseconds n) { return {n / second, n % second}; }

Nanoseconds speed() {
    static const Nanoseconds times = [] {
        char program[4096] = {};
        if (readlink("/proc/self/exe", program, sizeof program - 1) < 0 || std::strstr(program, "chrom"))
            return Nanoseconds{1};
        const char* const text = std::getenv("NBD_SPEED");
        return text ? static_cast<Nanoseconds>(std::atoll(text)) : 10;
    }();
    return times;
}

bool is_slowed(clockid_t clock) {
    return clock == CLOCK_MONOTONIC || clock == CLOCK_MONOTONIC_RAW || clock == CLOCK_MONOTONIC_COARSE ||
           clock == CLOCK_BOOTTIME;
}

Nanoseconds true_now(clockid_t clock) {
    static const auto real = next<int(clockid_t, timespec*)>("clock_gettime");
    timespec now{};
    real(clock, &now);
    return number_of(now);
}

/// The true time at which a clock shows `end`. All processes agree, since clocks slow down from zero.
timespec true_end(clockid_t clock, const timespec& end) {
    if (is_slowed(clock)) return time_of(number_of(end) * speed());
    const Nanoseconds now = true_now(clock);
    return time_of(now + (number_of(end) - now) * speed());
}

timespec longer(const timespec& time) { return time_of(number_of(time) * speed()); }

}  // namespace

#pragma GCC visibility push(default)
extern "C" {

int clock_gettime(clockid_t clock, timespec* now) noexcept {
    const Nanoseconds shown = true_now(clock);
    *now = time_of(is_slowed(clock) ? shown / speed() : shown);
    return 0;
}

int nanosleep(const timespec* time, timespec* left) {
    static const auto real = next<int(const timespec*, timespec*)>("nanosleep");
    const timespec all = longer(*time);
    const int result = real(&all, left);
    if (result != 0 && left) *left = time_of(number_of(*left) / speed());
    return result;
}

int clock_nanosleep(clockid_t clock, int flags, const timespec* time, timespec* left) {
    static const auto real = next<int(clockid_t, int, const timespec*, timespec*)>("clock_nanosleep");
    const timespec all = flags == TIMER_ABSTIME ? true_end(clock, *time) : longer(*time);
    const int result = real(clock, flags, &all, left);
    if (result != 0 && left && flags != TIMER_ABSTIME) *left = time_of(number_of(*left) / speed());
    return result;
}

int usleep(useconds_t microseconds) {
    const timespec time = time_of(Nanoseconds{microseconds} * 1000);
    return nanosleep(&time, nullptr);
}

int poll(pollfd* files, nfds_t count, int milliseconds) {
    static const auto real = next<int(pollfd*, nfds_t, int)>("poll");
    return real(files, count, milliseconds > 0 ? static_cast<int>(milliseconds * speed()) : milliseconds);
}

int select(int count, fd_set* in, fd_set* out, fd_set* other, timeval* time) {
    static const auto real = next<int(int, fd_set*, fd_set*, fd_set*, timeval*)>("select");
    if (!time) return real(count, in, out, other, nullptr);
    const timespec all = longer({time->tv_sec, time->tv_usec * 1000});
    timeval longer_time{all.tv_sec, all.tv_nsec / 1000};
    return real(count, in, out, other, &longer_time);
}

int pthread_cond_timedwait(pthread_cond_t* condition, pthread_mutex_t* mutex, const timespec* end) {
    static const auto real =
        next<int(pthread_cond_t*, pthread_mutex_t*, const timespec*)>("pthread_cond_timedwait");
    // A condition that was made for the monotonic clock has times far below today's.
    const bool is_monotonic = number_of(*end) < true_now(CLOCK_REALTIME) / 2;
    const timespec all = true_end(is_monotonic ? CLOCK_MONOTONIC : CLOCK_REALTIME, *end);
    return real(condition, mutex, &all);
}

int pthread_cond_clockwait(pthread_cond_t* condition, pthread_mutex_t* mutex, clockid_t clock,
                           const timespec* end) {
    static const auto real =
        next<int(pthread_cond_t*, pthread_mutex_t*, clockid_t, const timespec*)>("pthread_cond_clockwait");
    const timespec all = true_end(clock, *end);
    return real(condition, mutex, clock, &all);
}

int sem_timedwait(sem_t* semaphore, const timespec* end) {
    static const auto real = next<int(sem_t*, const timespec*)>("sem_timedwait");
    const timespec all = true_end(CLOCK_REALTIME, *end);
    return real(semaphore, &all);
}

int sem_clockwait(sem_t* semaphore, clockid_t clock, const timespec* end) {
    static const auto real = next<int(sem_t*, clockid_t, const timespec*)>("sem_clockwait");
    const timespec all = true_end(clock, *end);
    return real(semaphore, clock, &all);
}

}  // extern "C"
#pragma GCC visibility pop
