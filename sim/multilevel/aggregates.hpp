#pragma once

#include <Eigen/Core>
#include <vector>

#include "meshing/surface/mesh.hpp"
#include "sim/factor/block_pattern.hpp"
#include "sim/multilevel/block_sparse.hpp"

namespace nbd {

/// Groups of neighbouring rows of a matrix.
struct Aggregates {
    std::vector<int> of;  // [rows] aggregate of each row; -1 for rows without a strong neighbour
    int count = 0;
};

/// strong: for each row its strong neighbours, itself included. Each aggregate is a row with its strong
/// neighbours; rows in between join the neighbouring aggregate that has most of their neighbours.
Aggregates aggregate(const std::vector<std::vector<int>>& strong);

/// The strong neighbours of each row: those whose block is no smaller than `share` of the geometric mean of
/// both diagonal blocks, in the Frobenius norm.
template <int B>
std::vector<std::vector<int>> strong_neighbours(const BlockSparse<B, B>& A, double share) {
    std::vector<double> diagonal(A.rows(), 0);
    for (int i = 0; i < A.rows(); ++i) {
        const auto row = A.columns_of(i);
        for (std::size_t k = 0; k < row.size(); ++k)
            if (row[k] == i) diagonal[i] = A.block(i, k).norm();
    }
    std::vector<std::vector<int>> strong(diagonal.size());
    for (int i = 0; i < A.rows(); ++i) {
        const auto row = A.columns_of(i);
        for (std::size_t k = 0; k < row.size(); ++k) {
            const double squared = A.block(i, k).squaredNorm();
            if (squared > 0 && squared >= share * share * diagonal[i] * diagonal[row[k]])
                strong[i].push_back(row[k]);
        }
    }
    return strong;
}

/// For each row of a matrix, how its B unknowns move in each of the six rigid motions of the whole body.
template <int B>
using RigidModes = std::vector<Eigen::Matrix<double, B, 6>>;

/// Three translations, and three rotations about the mean of the nodes, scaled to be of similar size.
RigidModes<3> rigid_modes(const Nodes& X);

/// Piecewise rigid motions of aggregates.
template <int B>
struct Tentative {
    BlockSparse<B, 6> P;  // orthonormal columns, or zeros; row i has one block, none if i has no aggregate
    RigidModes<6> modes;  // of the aggregates: P times these are the modes of the rows
};

/// Orthonormalises the rigid motions of each aggregate. A motion that leaves an aggregate at rest, such as
/// the rotation of two nodes about their line, gives a zero column.
template <int B>
Tentative<B> tentative(const Aggregates& aggregates, const RigidModes<B>& modes);

}  // namespace nbd
