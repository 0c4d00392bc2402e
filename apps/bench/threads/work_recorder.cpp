#include "apps/bench/threads/work_recorder.hpp"

#include <fmt/format.h>

#include <limits>
#include <stdexcept>
#include <string>
#include <string_view>

namespace nbd {
namespace {

/// A file's path in the project.
std::string_view short_path(std::string_view file) {
    constexpr std::string_view own = __FILE__, in_project = "apps/bench/threads/work_recorder.cpp";
    static_assert(own.ends_with(in_project));
    constexpr std::string_view root = own.substr(0, own.size() - in_project.size());
    return file.starts_with(root) ? file.substr(root.size()) : file;
}

}  // namespace

WorkRecorder::WorkRecorder() : record_{{}, {""}}, before_(std::exchange(work_log(), this)) {
    last_ = Clock::now();
}

WorkRecorder::~WorkRecorder() { work_log() = before_; }

/// The time that this takes itself is left out.
void WorkRecorder::mark(WorkMark::Kind kind, std::uint16_t label, Clock::time_point now) {
    const std::chrono::duration<float> since = now - last_;
    record_.marks.push_back({kind, label, since.count()});
    last_ = Clock::now();
}

/// line 0: text is a name.
std::uint16_t WorkRecorder::label_of(const char* text, int line) {
    const auto [found, is_new] = labels_.try_emplace({text, line}, record_.labels.size());
    if (is_new) {
        if (record_.labels.size() > std::numeric_limits<std::uint16_t>::max())
            throw std::length_error("work: too many places");
        record_.labels.push_back(line > 0 ? fmt::format("{}:{}", short_path(text), line) : text);
    }
    return found->second;
}

void WorkRecorder::begin_loop(const char* file, int line) {
    const Clock::time_point now = Clock::now();
    ++depth_;
    mark(WorkMark::Kind::begin_loop, label_of(file, line), now);
}

void WorkRecorder::end_loop() {
    --depth_;
    mark(WorkMark::Kind::end_loop, 0);
}

void WorkRecorder::begin_phase(const char* name) {
    phases_.push_back(label_of(name, 0));
    if (depth_ == 0) mark(WorkMark::Kind::phase, phases_.back());
}

void WorkRecorder::end_phase() {
    phases_.pop_back();
    if (depth_ == 0) mark(WorkMark::Kind::phase, phases_.back());
}

WorkRecord WorkRecorder::take() {
    mark(WorkMark::Kind::phase, phases_.back());
    return {std::exchange(record_.marks, {}), record_.labels};
}

}  // namespace nbd
