#pragma once

#include <pybind11/pybind11.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <filesystem>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "apps/cli/output_paths.hpp"
#include "apps/python/bindings/typed.hpp"
#include "collision/base/stop.hpp"
#include "sim/factor/blas.hpp"

namespace nbd::python {

namespace py = pybind11;

/// Thrown by a long call that Ctrl-C stopped; Python sees a subclass of KeyboardInterrupt.
struct Stopped : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// While alive, other threads of Python run, and BLAS has one thread, as in the program. Calls of several
/// threads may overlap. Make it with the GIL.
class LongCall {
 public:
    LongCall() { hold_blas_to_one_thread(); }
    ~LongCall() = default;
    LongCall(const LongCall&) = delete;
    LongCall& operator=(const LongCall&) = delete;

 private:
    struct Running {
        Running();
        ~Running();
    } running_;  // begins and ends with the GIL
    py::gil_scoped_release released_;
    RestoredBlasThreads blas_;
};

/// A long call that reads or writes HDF5 files, whose library serves one thread at a time: such calls of
/// several threads wait for each other. Throws std::runtime_error inside a function that tells of progress,
/// whose call holds the files, and in the child of a fork during which another thread held them.
class FileCall : public LongCall {
 public:
    FileCall() : one_(files()) { holder_ = getpid(); }
    ~FileCall() { holder_ = 0; }

 private:
    static std::mutex& files();
    inline static std::atomic<pid_t> holder_ = 0;  // the process of the call that has the files; 0: none
    std::scoped_lock<std::mutex> one_;
};

/// While alive, Ctrl-C makes stop_if_asked() of this thread throw, beside what Python does. Make it with the
/// GIL, before a LongCall.
class Stoppable {
 public:
    Stoppable();
    ~Stoppable();
    Stoppable(const Stoppable&) = delete;
    Stoppable& operator=(const Stoppable&) = delete;

    /// From any thread.
    bool asked() const noexcept { return is_stopped_ || presses_ != presses_before_; }
    void stop() noexcept { is_stopped_ = true; }

 private:
    static void count_and_pass_on(int signal);
    inline static std::atomic<int> presses_ = 0;  // of Ctrl-C while there was an object of this class

    std::atomic<bool> is_stopped_ = false;
    int presses_before_ = presses_;
    StopScope scope_{[this] { return asked(); }};
};

/// Raises what the signal handlers of Python raise, KeyboardInterrupt for Ctrl-C. Call it after a call that
/// was stopped; throws Stopped where no handler raises. what_is_kept: says it, and what to do.
[[noreturn]] void raise_stop(const std::string& what_is_kept);

/// Returns work(), which runs as a long call.
template <class Call = LongCall, class Work>
auto long_call(const Work& work) {
    const Call call;
    return work();
}

// For functions whose arguments and results are of C++ alone: all of the function is a long call, which
// Ctrl-C stops where the library calls stop_if_asked(). Nothing of a call that was stopped is kept.
using Computes = py::call_guard<LongCall>;
using UsesFiles = py::call_guard<FileCall>;
using ComputesLong = py::call_guard<Stoppable, LongCall>;
using UsesFilesLong = py::call_guard<Stoppable, FileCall>;

/// Writes an object to a file by write(path, object), after check_output().
template <auto write, class Object>
void write_checked(const std::filesystem::path& file, const Object& object) {
    check_output(file, {});
    write(file, object);
}

using ProgressFunction = Typed<"Optional[Progress]">;

/// A function of the caller that is told how far a long call is: function(what, done, total). What it raises
/// stops the call and is raised by check().
class Progress {
 public:
    /// stoppable: of the call; must outlive this object.
    Progress(ProgressFunction function, Stoppable& stoppable);

    /// From any thread.
    void tell(std::string_view what, double done, double total) noexcept;
    /// Throws what the function raised. Needs the GIL.
    void check() const;

 private:
    py::object function_;
    Stoppable& stoppable_;
    std::exception_ptr raised_;
};

/// A notice of the library becomes a warning of Python. From any thread.
void warn(std::string_view line) noexcept;

/// Waits until no thread is in a LongCall, and lets none begin another one. For the end of the interpreter,
/// which threads that hold objects of C++ must not see. Call it with the GIL.
void end_calls();

/// An object of ours that only one thread at a time may use.
class Lockable {
 public:
    /// name: of its class, for messages.
    explicit Lockable(const char* name) : name_(name) {}

 private:
    friend class Use;
    const char* name_;
    std::atomic<bool> is_used_ = false;
};

/// Marks an object as used while alive. Throws std::runtime_error, naming it, where another thread uses it.
class Use {
 public:
    explicit Use(Lockable& object) : Use(object, object.name_) {}
    Use(Lockable& object, const char* name) : object_(object) {
        if (object_.is_used_.exchange(true))
            throw std::runtime_error(
                std::string(name) +
                ": is in use by another thread; allowed: one at a time, or an object for each thread");
    }
    ~Use() { object_.is_used_ = false; }
    Use(const Use&) = delete;
    Use& operator=(const Use&) = delete;

 private:
    Lockable& object_;
};

/// An argument that is a Lockable, in use during the call.
template <class Object>
class Used {
 public:
    explicit Used(Object& object) : object_(object), use_(object) {}

    Object& operator*() const noexcept { return object_; }
    Object* operator->() const noexcept { return &object_; }

 private:
    Object& object_;
    Use use_;
};

/// Keeps the bodies of a list alive during a call, in which another thread may empty the list. name: of their
/// class. Throws std::invalid_argument where one is None or there twice.
template <class Object>
std::vector<py::object> keep(const std::vector<Object*>& bodies, const char* name) {
    std::vector<py::object> kept;
    for (auto body = bodies.begin(); body != bodies.end(); ++body) {
        if (!*body)
            throw std::invalid_argument("bodies[" + std::to_string(body - bodies.begin()) +
                                        "]: is None; allowed: a " + name);
        if (std::find(bodies.begin(), body, *body) != body)
            throw std::invalid_argument(std::string("bodies: one ") + name + " is there twice");
        kept.push_back(py::cast(*body, py::return_value_policy::reference));
    }
    return kept;
}

}  // namespace nbd::python

namespace pybind11::detail {

template <class Object>
struct type_caster<nbd::python::Used<Object>> {
    using Argument = nbd::python::Used<Object>;
    static constexpr auto name = make_caster<Object>::name;
    template <class>
    using cast_op_type = const Argument&;

    bool load(handle source, bool convert) {
        make_caster<Object> object;
        if (!object.load(source, convert)) return false;
        used.emplace(cast_op<Object&>(object));
        return true;
    }
    operator const Argument&() const { return *used; }

    std::optional<Argument> used;
};

}  // namespace pybind11::detail
