#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "sim/factor/cholesky.hpp"
#include "sim/multilevel/block_sparse.hpp"
#include "sim/multilevel/coupling_sum.hpp"

namespace nbd {

/// The coarsest level of a coupled system, which is factorised. Rows of all bodies stand one below the other.
class CoarsestSolve {
 public:
    /// Begins the matrices of the bodies, without couplings, and factorises them. They must live until the
    /// next begin(). Throws std::runtime_error if one is not positive definite.
    void begin(std::vector<const BlockSparse<6, 6>*> matrices);

    /// Call at the start of a step: lets go of the places in the matrix that couplings have had.
    void begin_couplings() noexcept { is_new_ = true; }

    /// Factorises the matrices with these couplings, unless there are none and the factor has none. The
    /// places in the matrix of those since begin_couplings() are kept, because another analysis costs more
    /// than they do. Throws std::runtime_error if the sum is not positive definite.
    void set_couplings(const CouplingMatrix<6>& couplings);

    /// x = A^-1 b, [6 rows].
    void solve(std::span<const float> b, std::span<float> x);

 private:
    using Block = Eigen::Matrix<double, 6, 6>;
    int rows() const noexcept { return first_.back(); }
    template <class Visit>
    void for_each_block(const CouplingMatrix<6>& couplings, const Visit& visit) const;
    void analyze();

    std::vector<const BlockSparse<6, 6>*> matrices_;
    std::vector<int> first_{0};  // [bodies + 1] first row of each body
    // [rows] Columns at and right of the diagonal, in any order; they grow with the couplings that act.
    std::vector<std::vector<int>> columns_;
    bool is_new_ = true;        // nothing was factorised since the couplings began
    bool has_places_ = false;   // the factor has places of couplings
    bool is_analyzed_ = false;  // the factor belongs to pattern_
    BlockPattern pattern_;      // of the sum, the lower half; each row is two nodes of three unknowns
    SparseMatrix A_;            // likewise
    Cholesky cholesky_;
    Eigen::VectorXd x_;
};

}  // namespace nbd
