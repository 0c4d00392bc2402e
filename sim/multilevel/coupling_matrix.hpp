#pragma once

#include <Eigen/Core>
#include <vector>

#include "sim/multilevel/block_sparse.hpp"

namespace nbd {

/// What the couplings of a system add to the matrix of a level: a symmetric positive semi-definite matrix C
/// with blocks at the few rows that couplings touch.
template <int B>
struct CouplingMatrix {
    using Square = Eigen::Matrix<double, B, B>;
    /// Sweeps converge where this is more than a half. Up to 1 the reduction that is certain grows with it,
    /// but most errors shrink faster with less.
    static constexpr double damping_share = 0.6;
    static_assert(damping_share > 0.5);

    std::vector<int> rows;     // those rows of the level, ascending
    BlockSparse<B, B> blocks;  // columns: places in `rows`, as its rows
    /// [rows] Diagonal blocks of a matrix D >= damping_share C, which sweeps that take C from old values add
    /// to the diagonal.
    std::vector<Square> damping;

    bool empty() const noexcept { return rows.empty(); }
};

/// P^T C P, for prolongations P of the rows of C: a row of `prolongation` for each, with `rows` as its
/// columns. The damping of the result R follows from |R_pq v_p v_q| <= |R_pq| (t v_p^2 + v_q^2 / t) / 2, t >
/// 0.
template <int B>
CouplingMatrix<6> coarsen(const CouplingMatrix<B>& C, const BlockSparse<B, 6>& prolongation,
                          std::vector<int> rows);

extern template CouplingMatrix<6> coarsen(const CouplingMatrix<3>&, const BlockSparse<3, 6>&,
                                          std::vector<int>);
extern template CouplingMatrix<6> coarsen(const CouplingMatrix<6>&, const BlockSparse<6, 6>&,
                                          std::vector<int>);

}  // namespace nbd
