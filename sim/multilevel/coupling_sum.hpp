#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "sim/fem/step_system.hpp"
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

/// The sum of the couplings of a system that act, as a matrix over the nodes that they touch, without those
/// whose velocity is prescribed.
class CouplingSum {
 public:
    /// Begins other couplings, of which none acts yet.
    void begin(const CoupledSystem& system);

    /// Takes the matrices A of the couplings; those with A = 0 do not act. Nothing else of the couplings may
    /// have changed since begin(). Those that have acted since then keep their places, because other patterns
    /// cost more than these do.
    void update(const CoupledSystem& system);

    /// Rows: nodes of the system.
    const CouplingMatrix<3>& matrix() const noexcept { return matrix_; }
    /// The row of matrix() that belongs to a node of the system, or -1.
    int row_of(int node) const noexcept { return row_of_[node]; }
    /// Changes with the pattern of matrix().
    int pattern() const noexcept { return pattern_; }
    /// [couplings] Trace of A; 0 for those that do not act.
    const std::vector<double>& strengths() const noexcept { return strengths_; }

 private:
    void analyze(const CoupledSystem& system);
    template <class Visit>
    void for_each_term(const CoupledSystem& system, std::size_t coupling, const Visit& visit) const;
    void number_rows(const CoupledSystem& system);
    void list_weights(const CoupledSystem& system);
    std::vector<std::vector<int>> columns() const;
    void fill(const CoupledSystem& system);

    std::vector<double> strengths_;  // [couplings]
    std::vector<char> acted_;        // [couplings] non-zero for those that have acted since begin()
    std::vector<int> row_of_;        // [nodes of the system]
    // Weights of the free nodes of those that acted: a row for each coupling, columns as the rows of
    // matrix(), in the order of the coupling's terms and with repeats. And its transpose.
    BlockSparse<1, 1> weights_, of_rows_;
    std::vector<double> totals_;  // [couplings] sum of the magnitudes of these weights
    CouplingMatrix<3> matrix_;
    int pattern_ = 0;
};

}  // namespace nbd
