#pragma once

#include <pybind11/pybind11.h>

#include <atomic>
#include <exception>
#include <mutex>
#include <stdexcept>
#include <string>
#include <string_view>

#include "collision/base/stop.hpp"
#include "sim/factor/blas.hpp"

namespace nbd::python {

namespace py = pybind11;

/// Thrown by a long call that Ctrl-C stopped; Python sees a subclass of KeyboardInterrupt.
struct Stopped : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// While alive, other threads of Python run, and BLAS has one thread, as in the program. Calls of several
/// threads may overlap.
class LongCall {
 public:
    LongCall();
    ~LongCall() = default;
    LongCall(const LongCall&) = delete;
    LongCall& operator=(const LongCall&) = delete;

 private:
    struct End {
        ~End();
    } end_;  // destroyed last, when the GIL is held again
    py::gil_scoped_release released_;
    RestoredBlasThreads blas_;
};

/// A long call that reads or writes HDF5 files, whose library serves one thread at a time: such calls of
/// several threads wait for each other. Throws std::runtime_error inside a Progress, whose call holds the
/// files, and in the child of a fork during which another thread held them.
class FileCall : public LongCall {
 public:
    FileCall() : one_(files()) {}

 private:
    struct Turn {
        explicit Turn(std::mutex& mutex);
        ~Turn();
        std::scoped_lock<std::mutex> lock;
    };
    static std::mutex& files();
    Turn one_;
};

/// While alive, Ctrl-C sets asked(), beside what Python does, and stop_if_asked() of this thread looks at it.
/// Make it with the GIL, before a FileCall.
class Stoppable {
 public:
    Stoppable();
    ~Stoppable();
    Stoppable(const Stoppable&) = delete;
    Stoppable& operator=(const Stoppable&) = delete;

    const std::atomic<bool>& asked() const noexcept { return asked_; }
    void stop() noexcept { asked_ = true; }

 private:
    std::atomic<bool> asked_ = false;
    StopScope scope_{asked_};
};

/// Raises what the signal handlers of Python raise, KeyboardInterrupt for Ctrl-C. Call it after a call that
/// was stopped; throws Stopped where no handler raises.
[[noreturn]] void raise_stop(const std::string& what_is_kept);

/// Returns work(), which runs as a long call that Ctrl-C stops where the library calls stop_if_asked().
/// Throws as raise_stop() then; nothing of the work is kept.
template <class Call = LongCall, class Work>
auto stoppable(const Work& work) {
    Stoppable stop;
    try {
        const Call call;
        return work();
    } catch (const StopAsked&) {
        raise_stop("the call was stopped, nothing of it is kept");
    }
}

/// A function of the caller that is told how far a long call is: function(what, done, total). What it raises
/// stops the call and is raised by check().
class Progress {
 public:
    /// stoppable: of the call; must outlive this object.
    Progress(py::object function, Stoppable& stoppable);

    /// From any thread.
    void tell(std::string_view what, double done, double total) noexcept;
    /// Throws what the function raised. Needs the GIL.
    void check() const;

 private:
    py::object function_;
    Stoppable& stoppable_;
    std::exception_ptr raised_;
};

/// Notices of the library become warnings of Python at the end of each LongCall.
void collect_notices() noexcept;

/// Waits until no thread is in a LongCall, and lets none return from a later one. For the end of the
/// interpreter, which threads that hold objects of C++ must not see.
void end_calls();

/// For a fork, whose child has only the thread that forked: calls of other threads never end there. What they
/// share is held over the fork, and the child forgets them. Call them before it, and after it in the parent
/// and in the child.
void before_fork();
void after_fork_in_parent();
void after_fork_in_child();

/// An object of ours that only one thread at a time may use.
class Lockable {
 public:
    Lockable() = default;

 private:
    friend class Use;
    std::atomic<bool> is_used_ = false;
};

/// Marks an object as used while alive. Throws std::runtime_error, naming it, where another thread uses it.
class Use {
 public:
    Use(Lockable& object, const char* name) : object_(object) {
        if (object_.is_used_.exchange(true))
            throw std::runtime_error(std::string(name) +
                                     ": is in use by another thread; allowed: one at a "
                                     "time, or an object for each thread");
    }
    ~Use() { object_.is_used_ = false; }
    Use(const Use&) = delete;
    Use& operator=(const Use&) = delete;

 private:
    Lockable& object_;
};

}  // namespace nbd::python
