#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "sim/factor/block_pattern.hpp"
#include "sim/factor/lane_blocks.hpp"
#include "sim/factor/sweep_matrix.hpp"

namespace nbd {

/// The symmetric matrix of a step, in 3x3 blocks. Those off the diagonal are in single precision, those on it
/// in double precision, so that rows keep their sums: moving all nodes alike costs no force. That of a rigid
/// body has all in double precision, too, as its stiffness outweighs its inertia by many millions.
class StepMatrix {
 public:
    /// Zeros. pattern: must outlive the matrix. order: of the pattern. exact: whether to keep blocks in
    /// double precision.
    StepMatrix(const BlockPattern& pattern, std::shared_ptr<const SweepOrder> order, bool exact)
        : pattern_(&pattern),
          blocks_(std::move(order)),
          exact_(exact ? pattern.block_count() : 0, Eigen::Matrix3d::Zero()),
          diagonal_(pattern.node_count(), Eigen::Matrix3d::Zero()) {}

    /// Blocks off the diagonal, and those on it, [N].
    const SweepMatrix<FloatBlocks<3, 3>>& blocks() const noexcept { return blocks_; }
    const std::vector<Eigen::Matrix3d>& diagonal() const noexcept { return diagonal_; }
    int node_count() const noexcept { return pattern_->node_count(); }

    /// The block in the row of node i and the column of its k-th neighbour in the pattern.
    Eigen::Matrix3d block(int i, int k) const noexcept;

    /// Sets a block off the diagonal; its transpose must be set too.
    void set(int i, int k, const Eigen::Matrix3f& block) noexcept { blocks_.set(i, k, block); }
    /// Likewise, of a matrix that is exact.
    void set_exactly(int i, int k, const Eigen::Matrix3d& block) noexcept {
        blocks_.set(i, k, block.cast<float>());
        exact_[pattern_->first_block(i) + k] = block;
    }

    /// Sets the diagonal blocks such that the blocks of row i sum up to sums[i] times the identity, as far as
    /// a symmetric block can. sums: [N].
    void balance_rows(const Eigen::VectorXd& sums);

    /// Adds a symmetric block to the diagonal.
    void add(int i, const Eigen::Matrix3d& block) noexcept { diagonal_[i] += block; }
    /// Adds a symmetric block off the diagonal, in row i and column j of the pattern, and takes it from the
    /// diagonal of i, so that rows keep their sums. Call it for j and i, too.
    void add_between(int i, int j, const Eigen::Matrix3d& block);

    /// Replaces row and column i by those of the identity.
    void isolate(int i);

    /// Row i of A v, summed in double precision. v: [3 N].
    Eigen::Vector3d multiply_row(int i, const double* v) const noexcept;

 private:
    const BlockPattern* pattern_;
    /// Calls visit(j, block) for the blocks of row i that are off the diagonal.
    template <class Visit>
    void for_each_beside(int i, const Visit& visit) const;

    SweepMatrix<FloatBlocks<3, 3>> blocks_;
    std::vector<Eigen::Matrix3d> exact_;  // [blocks] of a matrix that is exact, else empty
    std::vector<Eigen::Matrix3d> diagonal_;
};

}  // namespace nbd
