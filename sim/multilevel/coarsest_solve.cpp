#include "sim/multilevel/coarsest_solve.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace nbd {

void CoarsestSolve::add(int row, int column, const Eigen::Matrix<double, 6, 6>& block) {
    if (column < row) return;
    Row& to = rows_[static_cast<std::size_t>(row)];
    const auto known = std::ranges::find(to.columns, column);
    if (known != to.columns.end()) {
        to.blocks[static_cast<std::size_t>(known - to.columns.begin())] += block;
        return;
    }
    to.columns.push_back(column);
    to.blocks.push_back(block);
}

/// To the factor each row is two nodes with three unknowns.
void CoarsestSolve::factorize(std::span<const BlockSparse<6, 6>* const> matrices,
                              const LevelCouplings<6>& couplings, std::span<const ActingCoupling> acting) {
    int count = 0;
    for (const BlockSparse<6, 6>* A : matrices) count += A->rows();
    rows_.assign(static_cast<std::size_t>(count), {});
    x_.resize(6 * count);
    if (count == 0) return;
    int first = 0;
    for (const BlockSparse<6, 6>* A : matrices) {
        for (int i = 0; i < A->rows(); ++i) {
            const auto columns = A->columns_of(i);
            for (std::size_t k = 0; k < columns.size(); ++k)
                add(first + i, first + columns[k], A->block(i, k));
        }
        first += A->rows();
    }
    for (const ActingCoupling& coupling : acting) {
        const auto terms = couplings.of(coupling.index);
        for (const auto& to : terms) {
            const Eigen::Matrix<float, 3, 6> AJ = coupling.A * to.J;
            for (const auto& from : terms)
                if (from.row <= to.row) {
                    const Eigen::Matrix<float, 6, 6> block = from.J.transpose() * AJ;
                    add(from.row, to.row, block.cast<double>());
                }
        }
    }
    std::vector<std::vector<int>> nodes(static_cast<std::size_t>(2 * count));
    for (int i = 0; i < 2 * count; ++i)
        for (const int column : rows_[static_cast<std::size_t>(i / 2)].columns)
            for (const int j : {2 * column, 2 * column + 1})
                if (j >= i) nodes[static_cast<std::size_t>(i)].push_back(j);
    const BlockPattern pattern(std::move(nodes));
    SparseMatrix A = pattern.zero_matrix();
    for (int i = 0; i < 2 * count; ++i) {
        const Row& row = rows_[static_cast<std::size_t>(i / 2)];
        for (std::size_t k = 0; k < row.columns.size(); ++k)
            for (int c = 0; c < 2; ++c)
                if (const int j = 2 * row.columns[k] + c; j >= i)
                    pattern.block(A, i, pattern.find(i, j) - pattern.first_block(i)) =
                        row.blocks[k].block<3, 3>(3 * (i % 2), 3 * c).transpose();
    }
    cholesky_.analyze(A, Ordering::quick);
    cholesky_.factorize(A);
}

void CoarsestSolve::solve(std::span<const float> b, std::span<float> x) {
    if (x_.size() == 0) return;
    x_ = Eigen::Map<const Eigen::VectorXf>(b.data(), x_.size()).cast<double>();
    cholesky_.solve(x_, x_);
    Eigen::Map<Eigen::VectorXf>(x.data(), x_.size()) = x_.cast<float>();
}

}  // namespace nbd
