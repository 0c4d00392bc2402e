#pragma once

#include <vector>

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

}  // namespace nbd
