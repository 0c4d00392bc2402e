#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "apps/cli/output.hpp"
#include "meshing/body/body.hpp"

namespace nbd {

struct SolverRaceConfig {
    int steps = 10;             // of the scene before its system is taken
    int repeats = 5;            // times are medians over these
    double tolerance = 1e-6;    // |b - A v| over |b|
    int max_iterations = 1000;  // of rivals
};

/// One way of solving the linear system of one step, on one thread, from v = 0 or a guess of the deflation.
struct SolverTiming {
    std::string body, scene, solver;
    int nodes = 0;
    double once = 0;       // ms, for a body: what further steps do not make again
    double set_up = 0;     // ms, in each step
    double solve = 0;      // ms
    int iterations = 0;    // of the conjugate gradients
    double residual = 0;   // |b - A v| over |b|, where A is rounded as in StepProblem
    double megabytes = 0;  // heap that the solver holds, without the matrix
    /// Of our solver alone: bytes a second that an iteration reads, if it reads what the solver holds and the
    /// matrix once. Iterations read some of it twice, so this is a lower bound of the bandwidth used.
    double bandwidth = 0;
    std::string failure{};

    double total() const { return set_up + solve; }
};

/// Races our solver, a factorisation, and conjugate gradients with rival_preconditioners(), each made anew
/// for the step and, a second time, in the rest pose and kept, and with our preconditioner, plain and
/// deflated. The time of the deflation's vibration modes, all made together, counts once for a body, unless
/// its file has them.
std::vector<SolverTiming> race_solvers(const Body& body, const SolverRaceConfig& config, Output& out);

/// Writes CSV, one line per row. Atomic.
void write_table(const std::filesystem::path& path, std::span<const SolverTiming> rows);

}  // namespace nbd
