#pragma once

#include <Eigen/Core>
#include <vector>

#include "sim/factor/block_pattern.hpp"
#include "sim/factor/cholesky.hpp"
#include "sim/fem/coupled_system.hpp"

namespace nbd {

/// Exact solves on a patch of nodes of a coupled system, with zero velocity at all other nodes. A patch of
/// all nodes is the direct solver.
class PatchFactor {
 public:
    explicit PatchFactor(Ordering ordering) : ordering_(ordering) {}

    /// Call when the couplings are others than before; those of the next factorisations must be the same
    /// ones, but for their matrices.
    void begin() noexcept { is_new_ = true; }

    /// inside: [nodes of the system], non-zero for nodes that the patch must have. It keeps those that it has
    /// had since begin(), and the places of couplings that no longer act, because analysing a smaller pattern
    /// costs more than it saves. Throws std::runtime_error if the matrix of the patch is not positive
    /// definite or not finite.
    void factorize(const CoupledSystem& system, const std::vector<char>& inside);

    int node_count() const noexcept { return static_cast<int>(nodes_.size()); }
    bool empty() const noexcept { return nodes_.empty(); }

    /// v -= A_S^-1 (A v)_S on the patch S, so that A v vanishes there. The system must be the factorised one.
    void clear_product(const CoupledSystem& system, Eigen::VectorXd& v);

    /// v += A_S^-1 r_S on the patch.
    void add_solution(const Eigen::VectorXd& r, Eigen::VectorXd& v);

 private:
    /// A coupling at a node, and the node's weight in it.
    struct CouplingAt {
        int coupling;
        double weight;
    };
    bool is_covered(const CoupledSystem& system, const std::vector<char>& inside);
    void analyze(const CoupledSystem& system, const std::vector<char>& inside);
    void list_couplings(const CoupledSystem& system);
    template <class Visit>
    void for_each_coupled(const CoupledSystem& system, int s, const Visit& visit) const;
    std::vector<std::vector<int>> adjacency(const CoupledSystem& system) const;
    void fill(const CoupledSystem& system);
    void add_patch_solution(Eigen::VectorXd& v);

    Ordering ordering_;
    bool is_new_ = true;                 // nothing was factorised since begin()
    std::vector<char> acted_;            // [couplings] non-zero for those that have acted since begin()
    std::vector<int> nodes_;             // nodes of the patch, ascending
    std::vector<int> slot_;              // [nodes of the system] place in nodes_; -1 if outside
    std::vector<int> first_coupling_;    // [nodes of the patch + 1] range of couplings_
    std::vector<CouplingAt> couplings_;  // those that act and whose node is free
    BlockPattern pattern_;               // the lower half
    SparseMatrix A_;                     // likewise
    Cholesky cholesky_;
    bool analyzed_ = false;
    Eigen::VectorXd rhs_, product_;
};

}  // namespace nbd
