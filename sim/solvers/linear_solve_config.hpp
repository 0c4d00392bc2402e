#pragma once

namespace nbd {

enum class LinearSolver {
    iterative,  // conjugate gradients; see CoupledSolver
    direct,     // a sparse factorisation of the whole system for every solve: the reference
};

/// How the linear systems of a step are solved.
struct LinearSolveConfig {
    LinearSolver solver = LinearSolver::iterative;
    double tolerance = 1e-6;  // |b - A v| over |b|, of nodes that are not prescribed; > 0 and < 1
    int max_iterations = 80;  // > 0; the system is factorised after them
};

}  // namespace nbd
