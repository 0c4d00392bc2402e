#pragma once

namespace nbd {

enum class LinearSolver {
    iterative,  // conjugate gradients; see CoupledSolver
    direct,     // the reference: a sparse factorisation of the whole system for every solve
};

/// Settings for the linear systems of a step.
struct LinearSolveConfig {
    LinearSolver solver = LinearSolver::iterative;
    // Residual of every body relative to its impulses in the step, see ContactSolver::scales(); > 0 and < 1.
    double tolerance = 1e-5;
    /// > 0; of systems of up to 10,000 nodes, and in proportion of larger ones. After these the system is
    /// factorised, which costs more, the more nodes there are.
    int max_iterations = 80;
};

}  // namespace nbd
