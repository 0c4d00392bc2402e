#pragma once

namespace nbd {

/// Is told by a thread what it does, so that it can be counted how much of it other threads could take. A
/// loop's tasks do not wait for each other; all that lies outside of tasks waits for what was before it.
/// Phases and loops may lie inside of each other. Calls must be paired, also where something is thrown.
class WorkLog {
 public:
    virtual ~WorkLog() = default;

    /// file, line: where the loop is, as __FILE__ and __LINE__; must outlive the log.
    virtual void begin_loop(const char* file, int line) = 0;
    virtual void begin_task() = 0;
    virtual void end_task() = 0;
    virtual void end_loop() = 0;
    /// name: must outlive the log.
    virtual void begin_phase(const char* name) = 0;
    virtual void end_phase() = 0;
};

/// The log that this thread tells of its work; null but while a benchmark counts it, on one thread.
inline WorkLog*& work_log() noexcept {
    static thread_local WorkLog* log = nullptr;
    return log;
}

}  // namespace nbd
