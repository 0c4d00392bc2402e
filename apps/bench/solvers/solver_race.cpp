#include "apps/bench/solvers/solver_race.hpp"

#include <fmt/format.h>

#include <array>
#include <memory>
#include <stdexcept>
#include <utility>

#include "apps/bench/measure/heap.hpp"
#include "apps/bench/solvers/deflated_times.hpp"
#include "apps/bench/solvers/iteration_times.hpp"
#include "apps/bench/solvers/preconditioner.hpp"
#include "apps/bench/solvers/step_problems.hpp"
#include "collision/base/stopwatch.hpp"
#include "meshing/h5/atomic_file.hpp"
#include "sim/solvers/coupled_solver.hpp"

namespace nbd {
namespace {

std::size_t bytes_of(const StepMatrix& matrix) {
    const std::size_t before = heap_bytes();
    const StepMatrix copy = matrix;
    return heap_bytes() - before;
}

/// Our solver as the simulator uses it, or its factorisation.
void time_ours(const StepProblem& problem, LinearSolver kind, const SolverRaceConfig& config,
               SolverTiming& row) {
    const std::array<int, 2> first_unknown{0, static_cast<int>(problem.b.size())};
    const CoupledSystem system{
        .systems = {&problem.system, 1}, .first_unknown = first_unknown, .terms = {}, .couplings = {}};
    const std::size_t before = heap_bytes();
    CoupledSolver solver({.solver = kind, .tolerance = config.tolerance});
    // Their norm weighs nodes by the inverse of their masses; this goal bounds the plain one for all rivals.
    const double heaviest = problem.system.body().node_masses().maxCoeff();
    const std::vector<double> goals{config.tolerance * problem.b.norm() / std::sqrt(heaviest)};
    Eigen::VectorXd v;
    Times times;
    for (int k = 0; k <= config.repeats; ++k) {  // the first one makes what the body keeps
        v.setZero(problem.b.size());
        const Stopwatch set_up;
        solver.begin_matrices(system);
        const double prepared = set_up.seconds();
        const LinearSolveReport report = solver.solve(system, problem.b, goals, v);
        const double all = set_up.seconds();
        row.iterations = report.iterations;
        row.failure = report.fallback;
        if (k == 0) {
            row.once = 1e3 * all;
            continue;
        }
        times.set_up.push_back(1e3 * prepared);
        times.solve.push_back(1e3 * (all - prepared));
    }
    times.into(row);
    row.once -= row.total();
    const std::size_t held = heap_bytes() - before;
    row.megabytes = static_cast<double>(held) / 1e6;
    row.residual = relative_residual(problem, v);
    if (row.iterations > 0)
        row.bandwidth = static_cast<double>(held + bytes_of(problem.system.matrix())) * row.iterations /
                        (1e-3 * row.solve);
}

/// made_for: the system that the preconditioner is made for; where that is not `problem`, it is kept.
void time_rival(const StepProblem& problem, const StepProblem& made_for, MakePreconditioner make,
                const SolverRaceConfig& config, SolverTiming& row) {
    const bool kept = &made_for != &problem;
    const RowMajor A = problem.A;
    std::unique_ptr<Preconditioner> preconditioner;
    Times times;
    for (int k = 0; k < config.repeats; ++k) {
        if (!kept || k == 0) {
            preconditioner.reset();
            preconditioner = make(made_for.A, made_for.x);
            const std::size_t before = heap_bytes();
            const Stopwatch set_up;
            preconditioner->set_up();
            times.set_up.push_back(1e3 * set_up.seconds());
            row.megabytes = (static_cast<double>(heap_bytes()) - static_cast<double>(before)) / 1e6;
        }
        time_iterations(problem, A, *preconditioner, config, times, row);
    }
    times.into(row);
    if (kept) row.once = std::exchange(row.set_up, 0);
}

}  // namespace

std::vector<SolverTiming> race_solvers(const Body& body, const SolverRaceConfig& config, Output& out) {
    const auto elastic = std::make_shared<const ElasticBody>(body);
    LowestModes modes(body, *elastic);
    std::vector<SolverTiming> rows;
    for (const auto& [rest, moved] : step_problems(body, elastic, config.steps)) {
        const auto add = [&](const std::string& solver, auto&& time) {
            out.progress(
                fmt::format("{} {} nodes, {}: {}", body.name, elastic->node_count(), moved.scene, solver),
                static_cast<int>(rows.size()), static_cast<int>(rows.size()) + 1);
            SolverTiming row{
                .body = body.name, .scene = moved.scene, .solver = solver, .nodes = elastic->node_count()};
            try {
                time(row);
            } catch (const std::runtime_error& error) {
                row.failure = error.what();
            }
            rows.push_back(row);
        };
        add("ours", [&](SolverTiming& row) { time_ours(moved, LinearSolver::iterative, config, row); });
        for (const int count : deflated_counts)
            add(count == 0 ? "ours (plain iteration)" : fmt::format("ours ({} motions deflated)", count),
                [&](SolverTiming& row) { time_deflated(moved, modes, count, config, row); });
        for (const PreconditionerEntry& rival : rival_preconditioners()) {
            add(rival.name, [&](SolverTiming& row) { time_rival(moved, moved, rival.make, config, row); });
            add(rival.name + " (kept)",
                [&](SolverTiming& row) { time_rival(moved, rest, rival.make, config, row); });
        }
        add("factorisation", [&](SolverTiming& row) { time_ours(moved, LinearSolver::direct, config, row); });
    }
    return rows;
}

void write_table(const std::filesystem::path& path, std::span<const SolverTiming> rows) {
    h5::AtomicFile file(path);
    file.out() << "body,nodes,scene,solver,once_ms,set_up_ms,solve_ms,iterations,residual,megabytes,"
                  "bandwidth,failure\n";
    for (const SolverTiming& r : rows)
        file.out() << fmt::format("{},{},{},{},{:.3f},{:.3f},{:.3f},{},{:.2g},{:.1f},{:.3g},{}\n", r.body,
                                  r.nodes, r.scene, r.solver, r.once, r.set_up, r.solve, r.iterations,
                                  r.residual, r.megabytes, r.bandwidth, r.failure);
    file.commit();
}

}  // namespace nbd
