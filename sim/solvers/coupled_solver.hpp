#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "sim/solvers/coupled_system.hpp"
#include "sim/solvers/linear_solve_config.hpp"
#include "sim/solvers/patch_factor.hpp"
#include "sim/solvers/rest_factor.hpp"

namespace nbd {

struct LinearSolveReport {
    int iterations = 0;   // conjugate gradient iterations
    int patch_nodes = 0;  // nodes solved exactly in each iteration
    double residual = 0;  // |b - A v| over |b|
    bool converged = true;
    std::string fallback{};  // empty, or one line: why the system was factorised
};

/// Solves coupled systems by conjugate gradients. The preconditioner combines two parts: each body's rest
/// factor, rotated with its nodes (RestFactor), and an exact solve on a patch of nodes where that
/// approximation is poor. The patch has the nodes in contact, the nodes whose elements are rotated unevenly,
/// and two layers around them. The residual on the patch stays zero (multiplicative Schwarz). If the patch
/// would be most of the system, or the iteration does not converge, the whole system is factorised: a direct
/// solve.
class CoupledSolver {
 public:
    explicit CoupledSolver(const LinearSolveConfig& config = {},
                           std::shared_ptr<RestFactors> factors = nullptr);

    /// Call when the matrices of the bodies or the couplings have changed. solve() may follow any number of
    /// times, for any matrices of the couplings.
    void begin_matrices(const CoupledSystem& system);

    /// Solves A v = b until |b - A v| <= goal; the config's tolerance is not used here. v: initial guess on
    /// entry, solution on return. Throws std::runtime_error if a factorisation fails.
    LinearSolveReport solve(const CoupledSystem& system, const Eigen::VectorXd& b, double goal,
                            Eigen::VectorXd& v);

 private:
    std::vector<char> choose_patch(const CoupledSystem& system) const;
    void precondition(const CoupledSystem& system, const Eigen::VectorXd& r, Eigen::VectorXd& z);
    bool iterate(const CoupledSystem& system, double goal, int most, Eigen::VectorXd& v,
                 LinearSolveReport& report);
    bool refine(const CoupledSystem& system, const Eigen::VectorXd& b, double goal, int most,
                Eigen::VectorXd& v, LinearSolveReport& report);
    void factorize_patch(const CoupledSystem& system, LinearSolveReport& report);

    LinearSolveConfig config_;
    std::shared_ptr<RestFactors> factors_;
    std::vector<std::shared_ptr<const RestFactor>> rest_;  // [bodies]
    std::vector<NodeRotations> rotations_;                 // [bodies]
    bool whole_ = false;                                   // the preconditioner is direct_
    bool factorized_ = false;                              // direct_ belongs to the current matrices
    PatchFactor patch_{Ordering::quick}, direct_{Ordering::thorough};
    Eigen::VectorXd r_, z_, p_, Ap_, zero_;
    std::vector<float> y_, work_;
};

}  // namespace nbd
