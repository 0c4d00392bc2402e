#include "apps/python/bindings/long_call.hpp"

#include <csignal>
#include <utility>
#include <vector>

#include "collision/base/notice.hpp"

namespace nbd::python {
namespace {

std::atomic<bool> asked_to_stop = false;
std::mutex calls;
int running = 0;
struct sigaction before;  // what handled Ctrl-C when the first of the running calls began

/// Also calls the handler of Python, which only notes the signal.
void note_and_pass_on(int signal) {
    asked_to_stop = true;
    if (!(before.sa_flags & SA_SIGINFO) && before.sa_handler != SIG_DFL && before.sa_handler != SIG_IGN)
        before.sa_handler(signal);
}

std::mutex collecting;
std::vector<std::string> notices;

}  // namespace

void collect_notices() noexcept {
    set_notice_handler([](std::string_view line) {
        const std::scoped_lock lock(collecting);
        notices.emplace_back(line);
    });
}

LongCall::Warnings::~Warnings() {
    std::vector<std::string> lines;
    {
        const std::scoped_lock lock(collecting);
        lines.swap(notices);
    }
    py::error_scope kept;  // of an exception that is on its way
    for (const std::string& line : lines)
        if (PyErr_WarnEx(PyExc_UserWarning, line.c_str(), 1) != 0) PyErr_WriteUnraisable(nullptr);
}

LongCall::LongCall() {
    hold_blas_to_one_thread();
    const std::scoped_lock lock(calls);
    if (running++ > 0) return;
    asked_to_stop = false;
    struct sigaction ours {};
    ours.sa_handler = note_and_pass_on;
    sigemptyset(&ours.sa_mask);
    ours.sa_flags = SA_RESTART;
    sigaction(SIGINT, &ours, &before);
}

LongCall::~LongCall() {
    const std::scoped_lock lock(calls);
    if (--running > 0) return;
    sigaction(SIGINT, &before, nullptr);
}

const std::atomic<bool>& LongCall::asked() noexcept { return asked_to_stop; }
void LongCall::stop() noexcept { asked_to_stop = true; }

std::mutex& FileCall::file_calls() {
    static std::mutex one;
    return one;
}

void raise_stop(const std::string& what_is_kept) {
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    throw Stopped(what_is_kept);
}

Progress::Progress(py::object function) : function_(std::move(function)) {
    if (!function_.is_none() && !PyCallable_Check(function_.ptr()))
        throw std::invalid_argument("progress: is not callable; allowed: a function(what, done, total)");
}

void Progress::tell(std::string_view what, double done, double total) noexcept {
    if (function_.is_none()) return;
    const py::gil_scoped_acquire acquired;
    if (raised_) return;
    try {
        function_(what, done, total);
    } catch (...) {
        raised_ = std::current_exception();
        LongCall::stop();
    }
}

void Progress::check() const {
    if (raised_) std::rethrow_exception(raised_);
}

}  // namespace nbd::python
