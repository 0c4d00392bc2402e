#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <span>
#include <vector>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// A symmetric matrix over 3 N unknowns (x y z of node 0 first). Both triangles are stored, so a column is
/// also a row.
using SparseMatrix = Eigen::SparseMatrix<double>;

/// Sparsity pattern of 3x3 blocks (i, j) over N nodes, symmetric and with the full diagonal. Maps each block
/// to its place in a SparseMatrix of this pattern.
class BlockPattern {
 public:
    BlockPattern() : offset_{0} {}
    /// One block for each pair of nodes that share a tetrahedron. tets: rows of four node indices in [0,
    /// node_count).
    BlockPattern(int node_count, const Tets& tets);
    /// rows: for each i its nodes j, in any order, repeats allowed. i itself may be missing; if row i has j,
    /// row j must have i. Rows that have only j >= i give the lower half, of which a Cholesky factor can be
    /// computed; its products are not those of the symmetric matrix.
    explicit BlockPattern(std::vector<std::vector<int>> rows);

    bool operator==(const BlockPattern&) const = default;

    int node_count() const noexcept { return offset_.size() - 1; }
    int block_count() const noexcept { return neighbour_.size(); }

    /// Nodes j with a block (i, j), including i; ascending.
    std::span<const int> neighbours(int i) const noexcept {
        return {neighbour_.data() + offset_[i], neighbour_.data() + offset_[i + 1]};
    }

    /// The pattern by rows: [N + 1] range of columns of each row, and the columns.
    std::span<const int> offsets() const noexcept { return offset_; }
    std::span<const int> columns() const noexcept { return neighbour_; }

    /// Index of block (i, j) in [0, block_count), or -1 if the pattern has none. Blocks are numbered by i,
    /// then by j.
    int find(int i, int j) const noexcept;

    bool has_block(int i, int j) const noexcept { return find(i, j) >= 0; }

    /// First block of node i. The block of its k-th neighbour is first_block(i) + k.
    int first_block(int i) const noexcept { return offset_[i]; }

    /// A compressed 3 N x 3 N matrix of zeros that stores every entry of the pattern.
    SparseMatrix zero_matrix() const;

    /// The block of A in columns 3 i .. 3 i + 2 and rows 3 j .. 3 j + 2, where j is the k-th neighbour of i.
    /// A must come from zero_matrix().
    auto block(SparseMatrix& A, int i, int k) const noexcept {
        return Slot(A.valuePtr() + value_index(i, k), Eigen::OuterStride<>(column_height(i)));
    }
    auto block(const SparseMatrix& A, int i, int k) const noexcept {
        return ConstSlot(A.valuePtr() + value_index(i, k), Eigen::OuterStride<>(column_height(i)));
    }

    /// out = A v, in parallel. A must come from zero_matrix() and be symmetric. out must not overlap v.
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
