#include "apps/bench/solvers/deflated_times.hpp"

#include <algorithm>

#include "apps/bench/measure/heap.hpp"
#include "collision/base/stopwatch.hpp"
#include "sim/fem/modes.hpp"

namespace nbd {

LowestModes::LowestModes(const Body& body, const ElasticBody& elastic)
    : elastic_(elastic), count_(std::min(most, most_modes(elastic.node_count()))), U_(body.modes.U) {}

void LowestModes::make() {
    if (U_.cols() >= count_) return;
    const Stopwatch stopwatch;
    U_ = vibration_modes(elastic_, {.count = count_}).basis.U;
    ms_ = 1e3 * stopwatch.seconds();
}

void time_deflated(const StepProblem& problem, LowestModes& modes, int count, const SolverRaceConfig& config,
                   SolverTiming& row) {
    const bool vibrates = count > DeflatedCycle::rigid_count;
    if (vibrates) modes.make();
    const RowMajor A = problem.A;
    const std::size_t before = heap_bytes();
    DeflatedCycle preconditioner(
        problem, modes.U(), std::min(count, DeflatedCycle::rigid_count + static_cast<int>(modes.U().cols())));
    Times times;
    for (int k = 0; k <= config.repeats; ++k) {  // the first one makes what the body keeps
        const Stopwatch set_up;
        preconditioner.set_up();
        const double ms = 1e3 * set_up.seconds();
        if (k == 0) {
            row.once = ms;
            row.megabytes = (static_cast<double>(heap_bytes()) - static_cast<double>(before)) / 1e6;
            continue;
        }
        times.set_up.push_back(ms);
        time_iterations(problem, A, preconditioner, config, times, row);
    }
    times.into(row);
    row.once += (vibrates ? modes.ms() : 0) - row.set_up;
}

}  // namespace nbd
