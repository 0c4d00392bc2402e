#include "apps/python/bindings/long_call.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <thread>
#include <utility>
#include <vector>

#include "collision/base/notice.hpp"

namespace nbd::python {
namespace {

std::mutex collecting;
std::vector<std::string> notices;

std::mutex counting;
std::condition_variable none_running;
int running = 0;
bool is_ending = false;

/// Never returns: this thread holds objects of C++ that the end of the interpreter would tear down.
[[noreturn]] void sleep_forever() {
    for (;;) std::this_thread::sleep_for(std::chrono::hours(1));
}

// What a handler of signals may touch: the flags of the calls that can be stopped.
std::array<std::atomic<std::atomic<bool>*>, 64> flags_of_calls{};
std::mutex handling;
int handlers = 0;
struct sigaction before;  // what handled Ctrl-C when the first of these calls began

/// Also calls the handler of Python, which only notes the signal.
void note_and_pass_on(int signal) {
    for (auto& flag : flags_of_calls)
        if (std::atomic<bool>* asked = flag.load()) *asked = true;
    before.sa_handler(signal);
}

/// Ends what note_and_pass_on() does.
void handle_as_before() {
    struct sigaction now {};
    sigaction(SIGINT, nullptr, &now);
    if (now.sa_handler == note_and_pass_on) sigaction(SIGINT, &before, nullptr);
}

// What this thread does.
thread_local bool is_in_progress = false;
thread_local std::vector<std::atomic<bool>*>
    own_flags;  // of its calls that can be stopped, each in the one before

std::atomic<bool> files_are_held = false;  // by a FileCall
bool files_are_lost = false;               // a fork left the thread that held them behind

}  // namespace

void collect_notices() noexcept {
    set_notice_handler([](std::string_view line) {
        const std::scoped_lock lock(collecting);
        notices.emplace_back(line);
    });
}

LongCall::End::~End() {
    std::vector<std::string> lines;
    {
        const std::scoped_lock lock(collecting);
        lines.swap(notices);
    }
    const py::error_scope kept;  // of an exception that is on its way
    for (const std::string& line : lines)
        if (PyErr_WarnEx(PyExc_UserWarning, line.c_str(), 1) != 0) PyErr_WriteUnraisable(nullptr);
    const std::scoped_lock lock(counting);
    if (--running == 0) none_running.notify_all();
}

LongCall::LongCall() {
    {
        std::unique_lock lock(counting);
        if (is_ending) {
            lock.unlock();
            sleep_forever();
        }
        ++running;
    }
    hold_blas_to_one_thread();
}

void end_calls() {
    const py::gil_scoped_release released;
    std::unique_lock lock(counting);
    is_ending = true;
    none_running.wait(lock, [] { return running == 0; });
}

void before_fork() {
    counting.lock();
    handling.lock();
    collecting.lock();
}

void after_fork_in_parent() {
    collecting.unlock();
    handling.unlock();
    counting.unlock();
}

void after_fork_in_child() {
    running = is_in_progress ? 1 : 0;
    files_are_lost = files_are_held && !is_in_progress;
    for (auto& flag : flags_of_calls)
        if (std::ranges::find(own_flags, flag.load()) == own_flags.end()) flag = nullptr;
    handlers = own_flags.size();
    if (handlers == 0) handle_as_before();
    after_fork_in_parent();
}

std::mutex& FileCall::files() {
    static std::mutex one;
    if (is_in_progress)
        throw std::runtime_error("progress: must not call functions that read or write files of nbdtree");
    if (files_are_lost)
        throw std::runtime_error(
            "files of nbdtree were in use by another thread when this process was forked; allowed: processes "
            "that are started anew (spawn), or a fork while no thread uses files");
    return one;
}

FileCall::Turn::Turn(std::mutex& mutex) : lock(mutex) { files_are_held = true; }
FileCall::Turn::~Turn() { files_are_held = false; }

Stoppable::Stoppable() {
    const std::scoped_lock lock(handling);
    own_flags.push_back(&asked_);
    for (auto& flag : flags_of_calls) {
        std::atomic<bool>* free = nullptr;
        if (flag.compare_exchange_strong(free, &asked_)) break;
    }
    if (handlers++ > 0) return;
    sigaction(SIGINT, nullptr, &before);
    if ((before.sa_flags & SA_SIGINFO) || before.sa_handler == SIG_DFL || before.sa_handler == SIG_IGN)
        return;
    struct sigaction ours = before;
    ours.sa_handler = note_and_pass_on;
    sigaction(SIGINT, &ours, nullptr);
}

Stoppable::~Stoppable() {
    const std::scoped_lock lock(handling);
    for (auto& flag : flags_of_calls) {
        std::atomic<bool>* ours = &asked_;
        flag.compare_exchange_strong(ours, nullptr);
    }
    own_flags.pop_back();
    if (--handlers == 0) handle_as_before();
}

void raise_stop(const std::string& what_is_kept) {
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    throw Stopped(what_is_kept);
}

Progress::Progress(py::object function, Stoppable& stoppable)
    : function_(std::move(function)), stoppable_(stoppable) {
    if (!function_.is_none() && !PyCallable_Check(function_.ptr()))
        throw std::invalid_argument("progress: is not callable; allowed: a function(what, done, total)");
}

void Progress::tell(std::string_view what, double done, double total) noexcept {
    if (function_.is_none()) return;
    const py::gil_scoped_acquire acquired;
    if (raised_) return;
    is_in_progress = true;
    try {
        function_(what, done, total);
    } catch (...) {
        raised_ = std::current_exception();
        stoppable_.stop();
    }
    is_in_progress = false;
}

void Progress::check() const {
    if (raised_) std::rethrow_exception(raised_);
}

}  // namespace nbd::python
