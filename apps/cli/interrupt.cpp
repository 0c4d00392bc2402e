#include "apps/cli/interrupt.hpp"

#include <unistd.h>

#include <atomic>
#include <csignal>
#include <deque>

#include "collision/base/temporary_files.hpp"

namespace nbd {
namespace {

std::atomic<bool> flag = false, finishes = false, clears_line = false, is_terminal = false;
std::string beginning;                           // must not change once signals are caught
std::atomic<const std::string*> kept = nullptr;  // null: what written_files() says
static_assert(std::atomic<bool>::is_always_lock_free && std::atomic<const std::string*>::is_always_lock_free);

void say(std::string_view text) {
    [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, text.data(), text.size());
}

/// The kinds of messages are put together from parts, since a signal handler must not allocate.
void on_signal(int signal) {
    if (clears_line) say("\r\033[K");
    if (finishes && !flag.exchange(true)) {
        if (is_terminal) say("stopping as soon as what was begun is complete; Ctrl-C again stops at once\n");
        return;
    }
    remove_temporaries();
    say(beginning);
    if (const std::string* const text = kept) {
        say(*text);
    } else if (const std::string_view files = written_files(); !files.empty()) {
        say(files);
        say(": written; the same command starts anew");
    } else {
        say("nothing was written; the same command starts anew");
    }
    say("\n");
    _exit(128 + signal);
}

}  // namespace

void catch_interrupts(std::string_view program) {
    beginning = std::string(program) + ": error: interrupted: ";
    is_terminal = isatty(STDERR_FILENO) != 0;
    struct sigaction action = {};
    action.sa_handler = on_signal;
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
    sigset_t signals;  // which the parent may have blocked
    sigemptyset(&signals);
    sigaddset(&signals, SIGINT);
    sigaddset(&signals, SIGTERM);
    pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);
}

void say_on_interrupt(std::string text) {
    static std::deque<std::string> said;  // a handler may still read earlier ones
    kept = text.empty() ? nullptr : &said.emplace_back(std::move(text));
}

void finish_on_interrupt(bool does_finish) noexcept { finishes = does_finish; }

void clear_line_on_interrupt(bool clears) noexcept { clears_line = clears; }

bool interrupted() noexcept { return flag; }

}  // namespace nbd
