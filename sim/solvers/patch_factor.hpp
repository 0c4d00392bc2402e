#pragma once

#include <Eigen/Core>
#include <vector>

#include "sim/factor/block_pattern.hpp"
#include "sim/factor/cholesky.hpp"
#include "sim/solvers/coupled_system.hpp"

namespace nbd {

/// Exact solves on a patch, some or all of the nodes of a coupled system, the velocities of the others being
/// zero. A patch of all nodes is the direct solver.
class PatchFactor {
 public:
    explicit PatchFactor(Ordering ordering) : ordering_(ordering) {}

    /// inside: [nodes of the system] not 0 for those of the patch. The symbolic analysis is kept from the
    /// last call where the pattern is the same. Throws std::runtime_error where the patch's matrix is not
    /// positive definite or not finite.
    void factorize(const CoupledSystem& system, const std::vector<char>& inside);

    int node_count() const noexcept { return static_cast<int>(nodes_.size()); }
    bool empty() const noexcept { return nodes_.empty(); }

    /// v += A_S^-1 (r_S - (A v)_S) on the patch S. The system as it was factorised.
    void correct(const CoupledSystem& system, const Eigen::VectorXd& r, Eigen::VectorXd& v);

    /// v += A_S^-1 r_S on the patch.
    void add_solution(const Eigen::VectorXd& r, Eigen::VectorXd& v);

 private:
    std::vector<std::vector<int>> adjacency(const CoupledSystem& system) const;
    void fill(const CoupledSystem& system);
    void add_patch_solution(Eigen::VectorXd& v);

    Ordering ordering_;
    std::vector<int> nodes_;  // of the patch, ascending
    std::vector<int> slot_;   // [nodes of the system] place in nodes_, or -1
    BlockPattern pattern_;
    SparseMatrix A_;
    Cholesky cholesky_;
    bool analyzed_ = false;
    Eigen::VectorXd rhs_, product_;
};

}  // namespace nbd
