#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <span>
#include <vector>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// A symmetric matrix over 3 N unknowns (x y z of node 0 first), both triangles stored, so that a column is
/// also a row.
using SparseMatrix = Eigen::SparseMatrix<double>;

/// Which 3x3 blocks (i, j) of a matrix over N nodes are stored, the diagonal among them. Symmetric. Knows
/// where each block lies in a SparseMatrix of this pattern.
class BlockPattern {
 public:
    BlockPattern() : offset_{0} {}
    /// Blocks of nodes that share a tetrahedron. tets: rows of four node indices in [0, node_count).
    BlockPattern(int node_count, const Tets& tets);
    /// rows: the nodes j of each i, in any order and any number of times; i itself need not be there, (j, i)
    /// must be.
    explicit BlockPattern(std::vector<std::vector<int>> rows);

    bool operator==(const BlockPattern&) const = default;

    int node_count() const noexcept { return static_cast<int>(offset_.size()) - 1; }
    int block_count() const noexcept { return static_cast<int>(neighbour_.size()); }

    /// Nodes j with a block (i, j), ascending, i among them.
    std::span<const int> neighbours(int i) const noexcept {
        return {neighbour_.data() + offset_[i], neighbour_.data() + offset_[i + 1]};
    }

    /// Index of block (i, j) in [0, block_count), or -1 where the pattern has none. Blocks are numbered by
    /// i, then by j.
    int find(int i, int j) const noexcept;

    bool has_block(int i, int j) const noexcept { return find(i, j) >= 0; }

    /// First block of node i; its k-th neighbour has block first_block(i) + k.
    int first_block(int i) const noexcept { return offset_[i]; }

    /// A 3 N x 3 N matrix of zeros, compressed, with every entry of the pattern stored.
    SparseMatrix zero_matrix() const;

    /// The block of A in columns 3 i .. 3 i + 2 and rows 3 j .. 3 j + 2, j the k-th neighbour of i. A must
    /// come from zero_matrix().
    auto block(SparseMatrix& A, int i, int k) const noexcept {
        return Slot(A.valuePtr() + value_index(i, k), Eigen::OuterStride<>(column_height(i)));
    }
    auto block(const SparseMatrix& A, int i, int k) const noexcept {
        return ConstSlot(A.valuePtr() + value_index(i, k), Eigen::OuterStride<>(column_height(i)));
    }

    /// Makes row and column i of A the identity's.
    void isolate(SparseMatrix& A, int i) const;

    /// out = A v, in parallel. A must come from zero_matrix() and be symmetric; out must not overlap v.
    void multiply(const SparseMatrix& A, const Eigen::Ref<const Eigen::VectorXd>& v,
                  Eigen::Ref<Eigen::VectorXd> out) const;

    /// Row i of A v.
    Eigen::Vector3d multiply_row(const SparseMatrix& A, int i, const double* v) const noexcept;

 private:
    using Slot = Eigen::Map<Eigen::Matrix3d, 0, Eigen::OuterStride<>>;
    using ConstSlot = Eigen::Map<const Eigen::Matrix3d, 0, Eigen::OuterStride<>>;

    Eigen::Index column_height(int i) const noexcept { return 3 * (offset_[i + 1] - offset_[i]); }
    Eigen::Index value_index(int i, int k) const noexcept {
        return 9 * static_cast<Eigen::Index>(offset_[i]) + 3 * k;
    }

    std::vector<int> offset_;     // [N + 1]
    std::vector<int> neighbour_;  // [blocks]
};

}  // namespace nbd
