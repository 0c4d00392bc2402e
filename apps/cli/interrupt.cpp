#include "apps/cli/interrupt.hpp"

#include <unistd.h>

#include <csignal>
#include <string>

#include "collision/base/temporary_files.hpp"

namespace nbd {
namespace {

std::atomic<bool> flag = false, finishes = false;
std::string interruption;  // must not change once signals are caught
static_assert(std::atomic<bool>::is_always_lock_free);

void on_signal(int signal) {
    if (finishes && !flag.exchange(true)) return;
    remove_temporaries();
    [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, interruption.data(), interruption.size());
    _exit(128 + signal);
}

}  // namespace

void catch_interrupts(std::string_view program) {
    interruption = std::string(program) + ": error: interrupted\n";
    struct sigaction action = {};
    action.sa_handler = on_signal;
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
}

void finish_on_interrupt() noexcept { finishes = true; }

const std::atomic<bool>& interrupt_flag() noexcept { return flag; }

}  // namespace nbd
