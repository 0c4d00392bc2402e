#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "sim/fem/step_system.hpp"
#include "sim/multilevel/coupling_sum.hpp"
#include "sim/multilevel/multilevel_cycle.hpp"
#include "sim/solvers/body_norms.hpp"
#include "sim/solvers/patch_factor.hpp"

namespace nbd {

enum class LinearSolver {
    iterative,  // conjugate gradients; see CoupledSolver
    direct,     // the reference: a sparse factorisation of the whole system for every solve
};

/// Settings for the linear systems of a step.
struct LinearSolveConfig {
    LinearSolver solver = LinearSolver::iterative;
    // Residual of every body relative to its impulses in the step, see ContactSolver::share_of_scales(); > 0
    // and < 1.
    double tolerance = 1e-5;
    /// > 0; of systems of up to 10,000 nodes, and in proportion of larger ones. After these the system is
    /// factorised, which costs more, the more nodes there are.
    int max_iterations = 80;
};

struct LinearSolveReport {
    int iterations = 0;   // conjugate gradient iterations
    double residual = 0;  // of the body that is farthest from its goal, as a share of that
    bool converged = true;
    std::string fallback{};  // empty, or one line: why the system was factorised
};

/// Solves coupled systems by conjugate gradients with a multilevel preconditioner (MultilevelCycle). If the
/// iteration does not converge, the system is factorised: a direct solve.
class CoupledSolver {
 public:
    /// hierarchies: may be shared with other solvers of the same bodies; null: not shared.
    explicit CoupledSolver(const LinearSolveConfig& config = {},
                           std::shared_ptr<RestHierarchies> hierarchies = nullptr);

    /// Call when the matrices of the bodies or the couplings have changed. solve() may follow any number of
    /// times, for any matrices of the couplings.
    void begin_matrices(const CoupledSystem& system);

    /// Solves A v = b until the norm of each body's residual, see norms(), is at most its goal or what
    /// rounding leaves, whichever is larger; the config's tolerance is not used here. So a body is solved as
    /// well beside others as alone. goals: [bodies]. v: initial guess on entry, solution on return. Throws
    /// std::runtime_error if b is not finite or a factorisation fails.
    LinearSolveReport solve(const CoupledSystem& system, const Eigen::VectorXd& b,
                            const std::vector<double>& goals, Eigen::VectorXd& v);

    /// Likewise, after b and the matrices of the couplings have changed since the last solve. change: what
    /// that has added to the residual b - A v, zero on prescribed nodes. The residual is carried on rather
    /// than measured, which saves products in double precision and lets rounding in single precision add up:
    /// solve() must follow before the result counts.
    LinearSolveReport solve_roughly(const CoupledSystem& system, const Eigen::VectorXd& b,
                                    const Eigen::VectorXd& change, const std::vector<double>& goals,
                                    Eigen::VectorXd& v);

    /// b - A v after the last solve, as it was measured or carried on.
    const Eigen::VectorXd& residual() const noexcept { return r_; }

    /// The norms of the system of the last begin_matrices().
    const BodyNorms& norms() const noexcept { return norms_; }
    /// What rounding may have left of each body's residual in the last solve(), in these norms.
    const std::vector<double>& rounding() const noexcept { return rounding_; }

 private:
    void set_goals(const CoupledSystem& system, const Eigen::VectorXd& b, const Eigen::VectorXd& v);
    double take_residual(const CoupledSystem& system, const Eigen::VectorXd& b, const Eigen::VectorXd& v);
    void precondition(const CoupledSystem& system, double norm);
    void begin_solve(const CoupledSystem& system, const std::vector<double>& goals);
    bool factorize_contacts(const CoupledSystem& system);
    void iterate(const CoupledSystem& system, int most, Eigen::VectorXd& v, LinearSolveReport& report);
    double refine_directly(const CoupledSystem& system, const Eigen::VectorXd& b, double left,
                           Eigen::VectorXd& v);
    bool refine(const CoupledSystem& system, const Eigen::VectorXd& b, int most, Eigen::VectorXd& v,
                LinearSolveReport& report);

    LinearSolveConfig config_;
    std::shared_ptr<RestHierarchies> hierarchies_;
    BodyNorms norms_;
    std::vector<double> wanted_, rounding_, goals_;  // [bodies] of the current solve
    CouplingSum couplings_;
    MultilevelCycle cycle_;
    bool direct_ = false;      // the preconditioner is factor_
    bool factorized_ = false;  // factor_ belongs to the current matrices
    PatchFactor patch_{Ordering::quick}, factor_{Ordering::thorough};
    Eigen::VectorXd r_, z_, Az_, p_, Ap_;
    Eigen::VectorXf cycle_in_, cycle_out_;
};

}  // namespace nbd
