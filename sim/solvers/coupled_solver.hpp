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
    int iterations = 0;   // of conjugate gradients
    int patch_nodes = 0;  // solved exactly in each of them
    double residual = 0;  // |b - A v| over |b|
    bool converged = true;
    std::string fallback{};  // empty, or one line: why the system was factorised after all
};

/// Solves coupled systems by conjugate gradients. The preconditioner stands on two legs: each body's rest
/// factor, turned with its nodes (RestFactor), and an exact solve on the patch of nodes where that is a poor
/// stand-in: those with a contact, those whose elements are turned in unlike ways, and two layers of nodes
/// around them. Both are combined so that the residual on the patch stays zero
/// (multiplicative Schwarz). Where the patch would be most of the system, or the iteration does not converge,
/// the patch becomes the whole system, which is the direct solve.
class CoupledSolver {
 public:
    explicit CoupledSolver(const LinearSolveConfig& config = {},
                           std::shared_ptr<RestFactors> factors = nullptr);

    /// To be called when the bodies' matrices have changed; solve() may follow any number of times, for any
    /// couplings.
    void begin_matrices(const CoupledSystem& system);

    /// Solves A v = b until |b - A v| <= goal; the config's tolerance has no say here. v: in, a guess; out,
    /// the solution. Throws std::runtime_error where a factorisation fails.
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
    bool whole_ = false;                                   // direct_ is the preconditioner
    bool factorized_ = false;                              // direct_ is of the bodies' present matrices
    PatchFactor patch_{Ordering::quick}, direct_{Ordering::thorough};
    Eigen::VectorXd r_, z_, p_, Ap_, zero_;
    std::vector<float> y_, work_;
};

}  // namespace nbd
