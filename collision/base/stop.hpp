#pragma once

#include <atomic>
#include <exception>
#include <utility>

namespace nbd {

/// Thrown by stop_if_asked().
struct StopAsked : std::exception {
    const char* what() const noexcept override { return "stopped on request"; }
};

/// While alive, stop_if_asked() looks at a flag when this thread calls it. The innermost scope of a thread
/// counts. Without a scope nothing is ever stopped.
class StopScope {
 public:
    /// asked: may be set from any thread or signal handler; must outlive this object.
    explicit StopScope(const std::atomic<bool>& asked) noexcept : outer_(std::exchange(current(), &asked)) {}
    ~StopScope() { current() = outer_; }
    StopScope(const StopScope&) = delete;
    StopScope& operator=(const StopScope&) = delete;

 private:
    static const std::atomic<bool>*& current() noexcept {
        static thread_local const std::atomic<bool>* asked = nullptr;
        return asked;
    }
    friend bool stop_asked() noexcept;

    const std::atomic<bool>* outer_;
};

/// Whether the innermost StopScope of this thread was asked to stop.
inline bool stop_asked() noexcept {
    const std::atomic<bool>* asked = StopScope::current();
    return asked && *asked;
}

/// Throws StopAsked if stop_asked(). Work that may take seconds calls it every so often, where nothing is
/// half done. In a parallel loop only the thread that began it can be stopped, which ends the loop.
inline void stop_if_asked() {
    if (stop_asked()) throw StopAsked();
}

}  // namespace nbd
