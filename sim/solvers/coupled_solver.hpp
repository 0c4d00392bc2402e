#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>

#include "sim/fem/coupled_system.hpp"
#include "sim/multilevel/coupling_sum.hpp"
#include "sim/multilevel/multilevel_cycle.hpp"
#include "sim/solvers/linear_solve_config.hpp"
#include "sim/solvers/patch_factor.hpp"

namespace nbd {

struct LinearSolveReport {
    int iterations = 0;   // conjugate gradient iterations
    double residual = 0;  // |b - A v| over |b|
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

    /// Solves A v = b until |b - A v| <= goal; the config's tolerance is not used here. v: initial guess on
    /// entry, solution on return. Throws std::runtime_error if b is not finite or a factorisation fails.
    LinearSolveReport solve(const CoupledSystem& system, const Eigen::VectorXd& b, double goal,
                            Eigen::VectorXd& v);

 private:
    double take_residual(const CoupledSystem& system, const Eigen::VectorXd& b, const Eigen::VectorXd& v);
    void precondition(const CoupledSystem& system, double norm);
    void factorize_contacts(const CoupledSystem& system);
    void iterate(const CoupledSystem& system, double goal, int most, Eigen::VectorXd& v,
                 LinearSolveReport& report);
    double refine_directly(const CoupledSystem& system, const Eigen::VectorXd& b, double goal, double left,
                           Eigen::VectorXd& v);
    bool refine(const CoupledSystem& system, const Eigen::VectorXd& b, double goal, int most,
                Eigen::VectorXd& v, LinearSolveReport& report);

    LinearSolveConfig config_;
    std::shared_ptr<RestHierarchies> hierarchies_;
    CouplingSum couplings_;
    MultilevelCycle cycle_;
    bool direct_ = false;      // the preconditioner is factor_
    bool factorized_ = false;  // factor_ belongs to the current matrices
    PatchFactor patch_{Ordering::quick}, factor_{Ordering::thorough};
    Eigen::VectorXd r_, z_, Az_, p_, Ap_;
    Eigen::VectorXf cycle_in_, cycle_out_;
};

}  // namespace nbd
