#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <array>
#include <vector>

#include "apps/bench/solvers/preconditioner.hpp"
#include "apps/bench/solvers/step_problems.hpp"
#include "sim/multilevel/coupling_sum.hpp"
#include "sim/multilevel/multilevel_cycle.hpp"

namespace nbd {

/// Our own preconditioner C, deflated: z = C r + W E^-1 W^T (r - A C r) with E = W^T A W, the A-DEF2 of
/// [Tang09]. It is symmetric for residuals with W^T r = 0, which guess() begins with and the iteration keeps.
/// W holds the rigid motions of the pose, then vibration modes of the rest pose, turned with the nodes as the
/// hierarchy is. Prescribed nodes have zero rows.
class DeflatedCycle final : public Preconditioner {
 public:
    static constexpr int rigid_count = 6;

    /// modes: [3 N, m] of the rest pose. count: columns of W, rigid_count to m + rigid_count, or 0, which
    /// leaves C alone. The problem and the modes must outlive the preconditioner.
    DeflatedCycle(const StepProblem& problem, const Eigen::MatrixXf& modes, int count);

    /// May be called again, as for the next step: only the first call makes what the body keeps.
    void set_up() override;
    bool guess(const Eigen::VectorXd& b, Eigen::VectorXd& v) override;
    void apply(const Eigen::VectorXd& r, Eigen::VectorXd& z) override;

 private:
    void turn_modes();
    void factorize();

    const StepProblem& problem_;
    const Eigen::MatrixXf& modes_;
    std::array<int, 2> first_unknown_;
    CoupledSystem system_;
    RestHierarchies hierarchies_;
    CouplingSum couplings_;
    MultilevelCycle cycle_;
    std::vector<Eigen::Matrix3f> rotations_;                                   // [N]
    Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> W_;  // [3 N, count]
    Eigen::LLT<Eigen::MatrixXd> E_;
    Eigen::VectorXf in_, out_, left_;  // [3 N]
};

}  // namespace nbd
