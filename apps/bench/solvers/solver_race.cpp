#include "apps/bench/solvers/solver_race.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>
#include <stdexcept>
#include <utility>

#include "apps/bench/measure/heap.hpp"
#include "apps/bench/measure/median.hpp"
#include "apps/bench/solvers/deflated_cycle.hpp"
#include "apps/bench/solvers/preconditioner.hpp"
#include "apps/bench/solvers/step_problems.hpp"
#include "collision/base/stopwatch.hpp"
#include "meshing/h5/atomic_file.hpp"
#include "sim/fem/modes.hpp"
#include "sim/solvers/coupled_solver.hpp"

namespace nbd {
namespace {

/// Motions that our own preconditioner is deflated by: none, the rigid ones, and these with vibration modes.
constexpr std::array deflated_counts{0, 6, 16, 32};

using RowMajor = Eigen::SparseMatrix<double, Eigen::RowMajor>;

/// Conjugate gradients, from v = 0 unless the preconditioner has a guess. Returns the number of iterations.
int conjugate_gradients(const RowMajor& A, const Eigen::VectorXd& b, Preconditioner& preconditioner,
                        double goal, int most, Eigen::VectorXd& v) {
    v.setZero(b.size());
    Eigen::VectorXd r = b, z, p, Ap;
    if (preconditioner.guess(b, v)) r -= A * v;
    double rz = 0;
    int k = 0;
    for (; k < most && r.norm() > goal; ++k) {
        preconditioner.apply(r, z);
        const double before = rz;
        rz = r.dot(z);
        if (k == 0)
            p = z;
        else
            p = z + rz / before * p;
        Ap.noalias() = A * p;
        const double step = rz / p.dot(Ap);
        v += step * p;
        r -= step * Ap;
    }
    return k;
}

/// Times of the repeats of one solver.
struct Times {
    std::vector<double> set_up{}, solve{};
    void into(SolverTiming& row) {
        row.set_up = median(set_up);
        row.solve = median(solve);
    }
};

double relative_residual(const StepProblem& problem, const Eigen::VectorXd& v) {
    return (problem.b - problem.A * v).norm() / problem.b.norm();
}

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
    Eigen::VectorXd v;
    Times times;
    for (int k = 0; k <= config.repeats; ++k) {  // the first one makes what the body keeps
        v.setZero(problem.b.size());
        const Stopwatch set_up;
        solver.begin_matrices(system);
        const double prepared = set_up.seconds();
        const LinearSolveReport report =
            solver.solve(system, problem.b, config.tolerance * problem.b.norm(), v);
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

/// Solves with a preconditioner that was set up. Adds the time, sets the iterations and the residual.
void time_iterations(const StepProblem& problem, const RowMajor& A, Preconditioner& preconditioner,
                     const SolverRaceConfig& config, Times& times, SolverTiming& row) {
    Eigen::VectorXd v;
    const Stopwatch solve;
    row.iterations = conjugate_gradients(A, problem.b, preconditioner, config.tolerance * problem.b.norm(),
                                         config.max_iterations, v);
    times.solve.push_back(1e3 * solve.seconds());
    row.residual = relative_residual(problem, v);
    if (!(row.residual <= 2 * config.tolerance))
        row.failure =
            fmt::format("a residual of {:.2g} is left after {} iterations", row.residual, row.iterations);
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

/// The lowest vibration modes of a body: those of its file, or else made once.
class LowestModes {
 public:
    LowestModes(const Body& body, const ElasticBody& elastic)
        : elastic_(elastic), count_(std::min(most, most_modes(elastic.node_count()))), U_(body.modes.U) {}

    void make() {
        if (U_.cols() >= count_) return;
        const Stopwatch stopwatch;
        U_ = vibration_modes(elastic_, {.count = count_}).basis.U;
        ms_ = 1e3 * stopwatch.seconds();
    }
    const Eigen::MatrixXf& U() const noexcept { return U_; }
    double ms() const noexcept { return ms_; }  // that make() took

 private:
    static constexpr int most = deflated_counts.back() - DeflatedCycle::rigid_count;
    const ElasticBody& elastic_;
    int count_;
    Eigen::MatrixXf U_;  // [3 N, count_] or more
    double ms_ = 0;
};

/// The conjugate gradients of the rivals with our preconditioner, deflated by so many motions.
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
