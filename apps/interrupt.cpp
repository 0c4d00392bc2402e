#include "apps/interrupt.hpp"

#include <unistd.h>

#include <csignal>

#include "meshing/h5/temporary_files.hpp"

namespace nbd {
namespace {

std::atomic<bool> flag = false;

void on_signal(int signal) {
    if (flag.exchange(true)) {
        h5::remove_temporaries();
        _exit(128 + signal);
    }
}

}  // namespace

void catch_interrupts() {
    struct sigaction action = {};
    action.sa_handler = on_signal;
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
}

const std::atomic<bool>& interrupt_flag() noexcept { return flag; }

}  // namespace nbd
