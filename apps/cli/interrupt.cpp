#include "apps/cli/interrupt.hpp"

#include <unistd.h>

#include <csignal>
#include <string_view>

#include "meshing/h5/temporary_files.hpp"

namespace nbd {
namespace {

std::atomic<bool> flag = false, finishes = false;
static_assert(std::atomic<bool>::is_always_lock_free);

void on_signal(int signal) {
    if (finishes && !flag.exchange(true)) return;
    h5::remove_temporaries();
    constexpr std::string_view message = "nbdtree: error: interrupted\n";
    [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, message.data(), message.size());
    _exit(128 + signal);
}

}  // namespace

void catch_interrupts() {
    struct sigaction action = {};
    action.sa_handler = on_signal;
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
}

void finish_on_interrupt() noexcept { finishes = true; }

const std::atomic<bool>& interrupt_flag() noexcept { return flag; }

}  // namespace nbd
