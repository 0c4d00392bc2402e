#pragma once

#include <span>
#include <vector>

#include "sim/fem/coupled_system.hpp"
#include "sim/multilevel/coupling_matrix.hpp"

namespace nbd {

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
    /// A free node of a coupling: its row, and its weight there.
    struct Term {
        int row, coupling;
        double weight;
    };
    void analyze(const CoupledSystem& system);
    template <class Visit>
    void for_each_term(const CoupledSystem& system, const Visit& visit) const;
    void number_rows(const CoupledSystem& system);
    void list_terms(const CoupledSystem& system);
    std::span<const int> terms_at(int row) const noexcept;
    std::span<const Term> terms_of(int coupling) const noexcept;
    std::vector<std::vector<int>> columns() const;
    void fill(const CoupledSystem& system);

    std::vector<double> strengths_;  // [couplings]
    std::vector<char> acted_;        // [couplings] non-zero for those that have acted since begin()
    std::vector<int> row_of_;        // [nodes of the system]
    std::vector<Term> terms_;        // of those that acted, coupling after coupling
    std::vector<int> first_term_;    // [couplings + 1] range of terms_
    std::vector<int> first_at_;      // [rows + 1] range of at_
    std::vector<int> at_;            // places in terms_, of one row after the other
    std::vector<double> totals_;     // [couplings] sum of the magnitudes of the weights of free nodes
    CouplingMatrix<3> matrix_;
    int pattern_ = 0;
};

}  // namespace nbd
