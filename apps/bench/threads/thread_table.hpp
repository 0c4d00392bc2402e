#pragma once

#include <string>
#include <vector>

#include "apps/bench/measure/rows.hpp"
#include "apps/bench/threads/work_count.hpp"

namespace nbd {

/// Wall-clock times of the same work on this many threads.
struct MeasuredTimes {
    int threads = 1;
    std::vector<double> seconds;  // of each step, or of each round
};

/// Those of counted_threads that this program may use.
std::vector<int> threads_here();

/// What was counted and measured of some work, in ms of a step or round: rows of kind "counted" and
/// "measured" (means) and "median" of all the work, then a "phase" each, and a "loop" or a "serial" part
/// each, the longest on 16 threads first. counted: of `steps` steps. Keys ms_1, ms_2 ...; null where nothing
/// was measured.
Rows thread_rows(const std::string& work, const WorkCount& count, int steps,
                 const std::vector<MeasuredTimes>& measured);

/// The tables for the screen: how many times faster, and where the time of 16 threads goes.
std::string thread_text(const Rows& rows);

}  // namespace nbd
