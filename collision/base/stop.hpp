#pragma once

#include <exception>
#include <functional>
#include <utility>

namespace nbd {

/// Thrown by stop_if_asked().
struct StopAsked : std::exception {
    const char* what() const noexcept override { return "stopped on request"; }
};

/// While alive, stop_if_asked() asks a function when this thread calls it. The innermost scope of a thread
/// counts. Without a scope nothing is ever stopped.
class StopScope {
 public:
    /// asked: whether to stop; must not throw. Once true, it stays so.
    explicit StopScope(std::function<bool()> asked)
        : asked_(std::move(asked)), outer_(std::exchange(current(), this)) {}
    ~StopScope() { current() = outer_; }
    StopScope(const StopScope&) = delete;
    StopScope& operator=(const StopScope&) = delete;

 private:
    static const StopScope*& current() noexcept {
        static thread_local const StopScope* scope = nullptr;
        return scope;
    }
    friend bool stop_asked() noexcept;

    std::function<bool()> asked_;
    const StopScope* outer_;
};

/// Whether the innermost StopScope of this thread was asked to stop.
inline bool stop_asked() noexcept {
    const StopScope* scope = StopScope::current();
    return scope && scope->asked_();
}

/// Throws StopAsked if stop_asked(). Work that may take seconds calls it every so often, where nothing is
/// half done. In a parallel loop only the thread that began it can be stopped, which ends the loop.
inline void stop_if_asked() {
    if (stop_asked()) throw StopAsked();
}

}  // namespace nbd
