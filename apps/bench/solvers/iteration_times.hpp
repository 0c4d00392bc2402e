#pragma once

#include <Eigen/SparseCore>
#include <vector>

#include "apps/bench/solvers/preconditioner.hpp"
#include "apps/bench/solvers/solver_race.hpp"
#include "apps/bench/solvers/step_problems.hpp"

namespace nbd {

/// The matrix of a step as conjugate gradients multiply with it.
using RowMajor = Eigen::SparseMatrix<double, Eigen::RowMajor>;

/// Times of the repeats of one solver, ms.
struct Times {
    std::vector<double> set_up{}, solve{};
    /// Writes the medians.
    void into(SolverTiming& row) const;
};

double relative_residual(const StepProblem& problem, const Eigen::VectorXd& v);

/// Solves by conjugate gradients with a preconditioner that was set up. A: the problem's matrix. Adds the
/// time, sets the iterations and the residual.
void time_iterations(const StepProblem& problem, const RowMajor& A, Preconditioner& preconditioner,
                     const SolverRaceConfig& config, Times& times, SolverTiming& row);

}  // namespace nbd
