#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "meshing/parallel/parallel_for.hpp"
#include "sim/factor/block_pattern.hpp"
#include "sim/factor/lane_blocks.hpp"
#include "sim/multilevel/block_sparse.hpp"
#include "sim/multilevel/coupling_sum.hpp"

namespace nbd {

/// A level of a coupled system: the matrices of all bodies, one below the other, and the couplings. It
/// smooths by Gauss-Seidel sweeps, forward before and backward after the correction by the coarser levels.
template <int B>
class CoupledLevel {
 public:
    using Square = Eigen::Matrix<float, B, B>;
    using Diagonal = std::span<const Eigen::Matrix<double, B, B>>;

    /// Begins the matrices of the bodies with their diagonal blocks, without couplings. Both must outlive the
    /// level.
    void begin(std::vector<const LevelMatrix<B>*> matrices, std::vector<Diagonal> diagonals);

    /// Takes other couplings.
    void set_couplings(const CouplingMatrix<B>& couplings);

    int rows() const noexcept { return first_.back(); }
    int first_row(std::size_t body) const noexcept { return first_[body]; }
    std::size_t body_of(int row) const noexcept;

    /// Calls visit(body, rows) for ranges of rows, which count from the body's first and together are all, in
    /// parallel.
    template <class Visit>
    void for_rows(const Visit& visit) const {
        parallel_for(
            std::ssize(task_begin_) - 1,
            [&](int task) {
                for (int k = task_begin_[task]; k < task_begin_[task + 1]; ++k)
                    visit(ranges_[k].body, ranges_[k].rows);
            },
            1);
    }

    /// z = about A^-1 b, residual = b - A z.
    void smooth_from_zero();

    /// Adds `correction`, by the coarser levels, to z and improves it. `b` is used up; `correction` becomes
    /// the change by the sweep.
    void correct_and_smooth();

    /// residual = b - A z, with the b before correct_and_smooth(), which must have been called last: half the
    /// work of a product.
    void take_residual();

    std::vector<float> b, z, residual, correction;  // [B rows]

 private:
    struct Part {
        std::size_t body;
        RowRange rows;  // of the body
    };
    void divide_rows();
    template <class Visit>
    void sweep_colour(std::size_t colour, const Visit& visit) const;
    void subtract_couplings(const float* from, float* to) const;
    template <class Times>
    void add_remainder(const float* from, float* to, const Times& times) const;
    void add_damping(const float* from, float* to) const;

    std::vector<const LevelMatrix<B>*> matrices_;
    std::vector<int> first_{0};               // [bodies + 1] first row of each body
    std::vector<Part> ranges_;                // of all rows, in order
    std::vector<int> task_begin_{0};          // ranges_ of each task
    std::vector<std::vector<Part>> colours_;  // those of all bodies; rows of a part are swept in order
    std::vector<Diagonal> diagonals_;         // of the bodies, without couplings
    std::vector<Square> inverses_;
    std::vector<int> coupled_;           // rows that couplings touch
    std::vector<Square> uncoupled_;      // their inverses without couplings
    std::vector<Square> damping_;        // what couplings add to their diagonal blocks
    RowLists coupling_lists_;            // of coupled_, with columns of the level
    FloatBlocks<B, B> coupling_blocks_;  // of the couplings, row after row
};

extern template class CoupledLevel<3>;
extern template class CoupledLevel<6>;

}  // namespace nbd
