#include "apps/bench/solvers/iteration_times.hpp"

#include <fmt/format.h>

#include "apps/bench/measure/median.hpp"
#include "collision/base/stopwatch.hpp"

namespace nbd {
namespace {

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

}  // namespace

void Times::into(SolverTiming& row) const {
    row.set_up = median(set_up);
    row.solve = median(solve);
}

double relative_residual(const StepProblem& problem, const Eigen::VectorXd& v) {
    return (problem.b - problem.A * v).norm() / problem.b.norm();
}

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

}  // namespace nbd
