#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace nbd {

/// An event in a thread's work and the time since the event before it.
struct WorkMark {
    enum class Kind : std::uint8_t {
        begin_loop,  // label: where the loop is
        begin_task,
        end_task,
        end_loop,
        phase,  // outside of loops, label: the phase that begins or goes on
    };
    Kind kind;
    std::uint16_t label = 0;
    float seconds = 0;
};

/// What a thread did, in order. Begins in the phase of label 0.
struct WorkRecord {
    std::vector<WorkMark> marks;
    std::vector<std::string> labels;
};

/// Takes the shorter time of each mark of two records of the same work, so that what else ran on the machine
/// hardly counts. Throws std::runtime_error if they are not of the same work.
void take_shorter_times(WorkRecord& record, const WorkRecord& other);

/// Numbers of threads for which work is counted; the last one stands for as many as there are tasks.
inline constexpr std::array counted_threads{1, 2, 4, 16, 64, std::numeric_limits<int>::max()};

/// Seconds for each of counted_threads.
using ThreadTimes = std::array<double, counted_threads.size()>;

/// The time that a loop takes on this many threads. A thread that has ended a task takes the next of the same
/// loop, or else of the loop that began first; tasks wait for the loops inside of them. Starting tasks costs
/// nothing, and they do not slow each other down.
/// loop: marks from begin_loop to the end_loop that belongs to it. threads: at least 1.
double scheduled_time(std::span<const WorkMark> loop, int threads);

/// The work of a loop, or what lies outside of loops in a phase after a loop, in all records.
struct WorkPlace {
    std::string phase;
    std::string place;  // of the loop; of work outside of loops: the loop before it, empty at a phase's start
    bool is_loop = false;
    long loops = 0, tasks = 0;  // tasks: those of inner loops, too
    ThreadTimes seconds{};
};

/// Sums up the work of records. Loops inside of tasks belong to the loop outside of all others.
class WorkCount {
 public:
    /// Throws std::invalid_argument where marks are not paired.
    void add(const WorkRecord& record);

    /// In the order of their first appearance.
    const std::vector<WorkPlace>& places() const noexcept { return places_; }

 private:
    WorkPlace& at(const std::string& phase, const std::string& place, bool is_loop);

    std::vector<WorkPlace> places_;
    std::map<std::pair<std::pair<std::string, std::string>, bool>, std::size_t> index_;
};

}  // namespace nbd
