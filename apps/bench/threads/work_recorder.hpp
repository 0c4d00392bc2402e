#pragma once

#include <chrono>
#include <map>
#include <utility>
#include <vector>

#include "apps/bench/threads/work_count.hpp"
#include "collision/base/work_log.hpp"

namespace nbd {

/// Records the work of the thread that makes it, as long as it lives. Loops must run on that thread alone.
class WorkRecorder final : public WorkLog {
 public:
    WorkRecorder();
    ~WorkRecorder() override;
    WorkRecorder(const WorkRecorder&) = delete;
    WorkRecorder& operator=(const WorkRecorder&) = delete;

    void begin_loop(const char* file, int line) override;
    void begin_task() override { mark(WorkMark::Kind::begin_task, 0); }
    void end_task() override { mark(WorkMark::Kind::end_task, 0); }
    void end_loop() override;
    void begin_phase(const char* name) override;
    void end_phase() override;

    /// What was recorded. Ends the record.
    WorkRecord take();

 private:
    using Clock = std::chrono::steady_clock;

    void mark(WorkMark::Kind kind, std::uint16_t label, Clock::time_point now = Clock::now());
    std::uint16_t label_of(const char* text, int line);

    WorkRecord record_;
    std::map<std::pair<const char*, int>, std::uint16_t> labels_;
    std::vector<std::uint16_t> phases_{0};
    int depth_ = 0;  // of loops
    Clock::time_point last_;
    WorkLog* before_;
};

}  // namespace nbd
