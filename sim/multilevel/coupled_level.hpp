#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "sim/multilevel/float_blocks.hpp"
#include "sim/multilevel/level_couplings.hpp"

namespace nbd {

/// A level of a coupled system: the matrices of all bodies, one below the other, and the couplings. It
/// smooths by Chebyshev polynomials in D^-1 A, where D are the diagonal blocks [Adams03].
template <int B>
class CoupledLevel {
 public:
    using Square = Eigen::Matrix<float, B, B>;
    using Diagonal = std::vector<Eigen::Matrix<double, B, B>>;

    /// Begins matrices, which must outlive the level, without couplings. diagonal: blocks of all rows, with
    /// their inverses. bound: of the eigenvalues of D^-1 A.
    void begin(std::vector<const FloatBlocks<B, B>*> matrices, Diagonal diagonal,
               std::vector<Square> inverses, float bound);

    /// Begins other couplings, of which none acts yet.
    void begin_couplings(LevelCouplings<B> couplings);
    void set_acting(std::span<const ActingCoupling> acting);
    const LevelCouplings<B>& couplings() const noexcept { return couplings_; }

    int rows() const noexcept { return first_.back(); }
    int first_row(std::size_t body) const noexcept { return first_[body]; }
    std::size_t body_of(int row) const noexcept;

    /// to -= A from; they must not overlap.
    void subtract_product(const float* from, float* to) const;

    /// z = about A^-1 residual, then residual -= A z.
    void smooth_from_zero();

    /// z += direction, the correction by the coarser levels; then improves z. `residual` is used up.
    void correct_and_smooth();

    std::vector<float> z, residual, direction;  // [B rows]

 private:
    void smooth();
    void step(float old_share, float new_share);
    void forget_acting();

    std::vector<const FloatBlocks<B, B>*> matrices_;
    std::vector<int> first_{0};  // [bodies + 1] first row of each body
    Diagonal diagonal_;          // [rows] without couplings
    std::vector<Square> inverses_;
    std::vector<int> touched_;       // rows whose inverses_ include couplings
    std::vector<Square> untouched_;  // their inverses without
    std::vector<int> place_;         // [rows] index in touched_; -1: not there
    LevelCouplings<B> couplings_;
    std::vector<ActingCoupling> acting_;
    float bound_ = 1;
};

extern template class CoupledLevel<3>;
extern template class CoupledLevel<6>;

}  // namespace nbd
