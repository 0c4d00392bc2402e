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

/// The columns of a sparse matrix's blocks, row after row; those of a row ascend.
struct RowLists {
    std::vector<int> offset{0};  // [rows + 1] range of `column`
    std::vector<int> column;

    bool operator==(const RowLists&) const = default;

    int rows() const noexcept { return offset.size() - 1; }
    std::span<const int> columns_of(int row) const noexcept {
        return {column.data() + offset[row], column.data() + offset[row + 1]};
    }
    void end_row() { offset.push_back(column.size()); }
};

/// For each of so many rows, the numbers of the items that are in it, ascending. row_of: of each item.
RowLists items_by_row(std::span<const int> row_of, int rows);

/// Sparsity pattern of 3x3 blocks (i, j) over N nodes, symmetric and with the full diagonal. Maps each block
/// to its place in a SparseMatrix of this pattern.
class BlockPattern {
 public:
    BlockPattern() = default;
    /// One block for each pair of nodes that share an element. elements: rows of node indices in [0,
    /// node_count).
    BlockPattern(int node_count, const ElementNodes& elements);
    /// rows: for each i its nodes j, in any order, repeats allowed. i itself may be missing; if row i has j,
    /// row j must have i. Rows that have only j >= i give the lower half, of which a Cholesky factor can be
    /// computed; its products are not those of the symmetric matrix.
    explicit BlockPattern(std::vector<std::vector<int>> rows);

    bool operator==(const BlockPattern&) const = default;

    int node_count() const noexcept { return lists_.rows(); }
    int block_count() const noexcept { return lists_.column.size(); }

    /// Nodes j with a block (i, j), including i; ascending.
    std::span<const int> neighbours(int i) const noexcept { return lists_.columns_of(i); }
    /// These of all nodes.
    const RowLists& lists() const noexcept { return lists_; }

    /// Index of block (i, j) in [0, block_count), or -1 if the pattern has none. Blocks are numbered by i,
    /// then by j.
    int find(int i, int j) const noexcept;

    /// First block of node i. The block of its k-th neighbour is first_block(i) + k.
    int first_block(int i) const noexcept { return lists_.offset[i]; }

    /// A compressed 3 N x 3 N matrix of zeros that stores every entry of the pattern.
    SparseMatrix zero_matrix() const;

    /// The block of A in columns 3 i .. 3 i + 2 and rows 3 j .. 3 j + 2, where j is the k-th neighbour of i.
    /// A must come from zero_matrix().
    auto block(SparseMatrix& A, int i, int k) const noexcept {
        return Slot(A.valuePtr() + value_index(i, k), Eigen::OuterStride<>(column_height(i)));
    }
    /// The block in columns 3 i .. 3 i + 2 and rows 3 j .. 3 j + 2, which the pattern must have.
    auto block_at(SparseMatrix& A, int i, int j) const noexcept {
        return block(A, i, find(i, j) - first_block(i));
    }

 private:
    using Slot = Eigen::Map<Eigen::Matrix3d, 0, Eigen::OuterStride<>>;

    Eigen::Index column_height(int i) const noexcept { return 3 * neighbours(i).size(); }
    Eigen::Index value_index(int i, int k) const noexcept {
        return 9 * static_cast<Eigen::Index>(first_block(i)) + 3 * k;
    }

    RowLists lists_;
};

}  // namespace nbd
