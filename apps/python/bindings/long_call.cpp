#include "apps/python/bindings/long_call.hpp"

#include <chrono>
#include <csignal>
#include <thread>
#include <utility>

namespace nbd::python {
namespace {

/// What threads share. Only read and changed with the GIL, so that a fork finds it whole.
struct Shared {
    pid_t process = 0;
    int running = 0, stoppable = 0;  // objects of LongCall and of Stoppable
};
thread_local int own_running = 0, own_stoppable = 0;  // of this thread, the only one in the child of a fork
thread_local bool is_in_python = false;  // whether it runs a function of the caller inside a call
bool is_ending = false;
struct sigaction before;  // what handled Ctrl-C before the first Stoppable

Shared& shared() {
    static Shared all;
    if (all.process != getpid()) all = {getpid(), own_running, own_stoppable};
    return all;
}

void count(int Shared::*number, int& own, int change) {
    shared().*number += change;
    own += change;
}

/// The handler of Ctrl-C in a struct as sigaction() takes it.
void (*handler())(int) {
    struct sigaction now {};
    sigaction(SIGINT, nullptr, &now);
    return now.sa_handler;
}

void sleep() { std::this_thread::sleep_for(std::chrono::milliseconds(1)); }

/// While alive, this thread has the GIL and must not use files.
struct InPython {
    InPython() : outer(std::exchange(is_in_python, true)) {}
    ~InPython() { is_in_python = outer; }
    py::gil_scoped_acquire acquired;
    bool outer;
};

}  // namespace

LongCall::Running::Running() {
    if (is_ending) {  // objects of C++ that this thread holds must not be torn down by the interpreter
        const py::gil_scoped_release released;
        for (;;) sleep();
    }
    count(&Shared::running, own_running, 1);
}

LongCall::Running::~Running() { count(&Shared::running, own_running, -1); }

void end_calls() {
    is_ending = true;
    while (shared().running > 0) {
        const py::gil_scoped_release released;
        sleep();
    }
}

std::mutex& FileCall::files() {
    static std::mutex one;
    if (is_in_python)
        throw std::runtime_error("progress: must not call functions that read or write files of nbdtree");
    if (const pid_t holder = holder_; holder != 0 && holder != getpid())
        throw std::runtime_error(
            "files of nbdtree were in use by another thread when this process was forked; allowed: processes "
            "that are started anew (spawn), or a fork while no thread uses files");
    return one;
}

/// Also calls the handler of Python, which only notes the signal.
void Stoppable::count_and_pass_on(int signal) {
    ++presses_;
    before.sa_handler(signal);
}

Stoppable::Stoppable() {
    count(&Shared::stoppable, own_stoppable, 1);
    if (handler() == count_and_pass_on) return;
    sigaction(SIGINT, nullptr, &before);
    if ((before.sa_flags & SA_SIGINFO) || before.sa_handler == SIG_DFL || before.sa_handler == SIG_IGN)
        return;
    struct sigaction ours = before;
    ours.sa_handler = count_and_pass_on;
    sigaction(SIGINT, &ours, nullptr);
}

Stoppable::~Stoppable() {
    count(&Shared::stoppable, own_stoppable, -1);
    if (shared().stoppable == 0 && handler() == count_and_pass_on) sigaction(SIGINT, &before, nullptr);
}

void raise_stop(const std::string& what_is_kept) {
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    throw Stopped(what_is_kept);
}

Progress::Progress(ProgressFunction function, Stoppable& stoppable)
    : function_(std::move(function)), stoppable_(stoppable) {
    if (!function_.is_none() && !PyCallable_Check(function_.ptr()))
        throw std::invalid_argument("progress: is not callable; allowed: a function(what, done, total)");
}

void Progress::tell(std::string_view what, double done, double total) noexcept {
    if (function_.is_none()) return;
    const InPython python;
    if (raised_) return;
    try {
        function_(what, done, total);
    } catch (...) {
        raised_ = std::current_exception();
        stoppable_.stop();
    }
}

void Progress::check() const {
    if (raised_) std::rethrow_exception(raised_);
}

void warn(std::string_view line) noexcept {
    const InPython python;
    const py::error_scope kept;  // of an exception that is on its way
    if (PyErr_WarnEx(PyExc_UserWarning, std::string(line).c_str(), 1) != 0) PyErr_WriteUnraisable(nullptr);
}

}  // namespace nbd::python
