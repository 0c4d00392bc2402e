#pragma once

#include <Eigen/Core>
#include <vector>

#include "sim/factor/block_pattern.hpp"
#include "sim/factor/cholesky.hpp"
#include "sim/fem/step_system.hpp"
#include "sim/multilevel/coupling_sum.hpp"

namespace nbd {

/// Exact solves on a patch of nodes of a coupled system, with zero velocity at all other nodes. A patch of
/// all nodes is the direct solver.
class PatchFactor {
 public:
    explicit PatchFactor(Ordering ordering) : ordering_(ordering) {}

    /// Call when the couplings are others than before; those of the next factorisations must be the same
    /// ones, but for their matrices.
    void begin() noexcept { is_new_ = true; }

    /// couplings: those of the system. inside: [nodes of the system], non-zero for nodes that the patch must
    /// have: for clear(), all nodes of every coupling that acts on two or more. It keeps those that it has
    /// had since begin(), because analysing a smaller pattern costs more than it saves. Returns whether the
    /// matrix of the patch is positive definite; if not, there is no factor. Throws std::runtime_error if it
    /// is not finite.
    bool factorize(const CoupledSystem& system, const CouplingSum& couplings,
                   const std::vector<char>& inside);

    /// Likewise, but factorises a matrix with up to a thousandth more on the diagonal if that of the patch is
    /// not positive definite: where elasticity outweighs the mass by millions, its rounding to single
    /// precision can leave turns of a body a negative energy. For add_solution() alone, by callers who
    /// measure what it leaves. Throws std::runtime_error if that is not enough.
    void factorize_nearly(const CoupledSystem& system, const CouplingSum& couplings,
                          const std::vector<char>& inside);

    int node_count() const noexcept { return nodes_.size(); }
    bool empty() const noexcept { return nodes_.empty(); }

    /// r = -A v on the patch, in double precision. The system must be the factorised one.
    void take_residual(const CoupledSystem& system, const CouplingSum& couplings, const Eigen::VectorXd& v,
                       Eigen::VectorXd& r) const;

    /// r -= A e and v += e, with e = A_S^-1 r_S on the patch S, so that r vanishes there. r: residual of v.
    /// The system must be the factorised one.
    void clear(const CoupledSystem& system, Eigen::VectorXd& r, Eigen::VectorXd& v);

    /// v += A_S^-1 r_S on the patch.
    void add_solution(const Eigen::VectorXd& r, Eigen::VectorXd& v);

 private:
    bool is_covered(const CouplingSum& couplings, const std::vector<char>& inside) const;
    void analyze(const CoupledSystem& system, const CouplingSum& couplings, const std::vector<char>& inside);
    template <class Visit>
    void for_each_block(const CoupledSystem& system, const CouplingSum& couplings, int s,
                        const Visit& visit) const;
    BlockPattern lower_half(const CoupledSystem& system, const CouplingSum& couplings) const;
    void find_border(const CoupledSystem& system);
    void solve(const Eigen::VectorXd& r);

    Ordering ordering_;
    bool is_new_ = true;       // nothing was factorised since begin()
    int coupled_by_ = 0;       // pattern of the couplings that were last factorised
    std::vector<int> nodes_;   // nodes of the patch, in the order of elimination
    std::vector<int> border_;  // nodes outside that the bodies' matrices couple with the patch, ascending
    std::vector<int> slot_;    // [nodes of the system] place in nodes_; -1 if outside
    BlockPattern pattern_;     // the lower half
    BlockPattern ascending_;   // likewise, with the nodes in ascending order
    std::vector<int> order_;   // of these, the first to be eliminated, the second, ...
    std::vector<int>
        places_;      // of blocks among those of their row in pattern_, as for_each_block() visits them
    SparseMatrix A_;  // likewise
    Cholesky cholesky_;
    bool analyzed_ = false;
    Eigen::VectorXd solution_;  // of the last solve, on the patch
    Eigen::VectorXd spread_;    // [unknowns] that of the last clear(), zero outside the patch
};

}  // namespace nbd
