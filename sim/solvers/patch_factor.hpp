#pragma once

#include <Eigen/Core>
#include <vector>

#include "sim/factor/block_pattern.hpp"
#include "sim/factor/cholesky.hpp"
#include "sim/solvers/coupled_system.hpp"

namespace nbd {

/// Exact solves on a patch of nodes of a coupled system, with zero velocity at all other nodes. A patch of
/// all nodes is the direct solver.
class PatchFactor {
 public:
    explicit PatchFactor(Ordering ordering) : ordering_(ordering) {}

    /// inside: [nodes of the system], non-zero for nodes of the patch. Reuses the last symbolic analysis if
    /// the pattern is the same. Throws std::runtime_error if the matrix of the patch is not positive definite
    /// or not finite.
    void factorize(const CoupledSystem& system, const std::vector<char>& inside);

    int node_count() const noexcept { return static_cast<int>(nodes_.size()); }
    bool empty() const noexcept { return nodes_.empty(); }

    /// v += A_S^-1 (r_S - (A v)_S) on the patch S. The system must be the factorised one.
    void correct(const CoupledSystem& system, const Eigen::VectorXd& r, Eigen::VectorXd& v);

    /// v += A_S^-1 r_S on the patch.
    void add_solution(const Eigen::VectorXd& r, Eigen::VectorXd& v);

 private:
    std::vector<std::vector<int>> adjacency(const CoupledSystem& system) const;
    void fill(const CoupledSystem& system);
    void add_patch_solution(Eigen::VectorXd& v);

    Ordering ordering_;
    std::vector<int> nodes_;  // nodes of the patch, ascending
    std::vector<int> slot_;   // [nodes of the system] place in nodes_; -1 if outside
    BlockPattern pattern_;
    SparseMatrix A_;
    Cholesky cholesky_;
    bool analyzed_ = false;
    Eigen::VectorXd rhs_, product_;
};

}  // namespace nbd
