#include "sim/multilevel/coarsest_solve.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace nbd {

void CoarsestSolve::begin(std::vector<const BlockSparse<6, 6>*> matrices) {
    matrices_ = std::move(matrices);
    first_.assign(1, 0);
    for (const BlockSparse<6, 6>* A : matrices_) first_.push_back(first_.back() + A->rows());
    x_.resize(6 * rows());
    is_new_ = has_places_ = true;
    set_couplings({});
}

void CoarsestSolve::set_couplings(const CouplingMatrix<6>& couplings) {
    if (rows() == 0 || (couplings.empty() && !has_places_ && cholesky_.factorized())) return;
    if (is_new_) columns_.assign(rows(), {});
    bool has_grown = false;
    for_each_block(couplings, [&](int row, int column, const Block&) {
        std::vector<int>& columns = columns_[row];
        if (std::ranges::find(columns, column) != columns.end()) return;
        columns.push_back(column);
        has_grown = true;
    });
    if (has_grown || !is_analyzed_) analyze();
    A_.coeffs().setZero();
    for_each_block(couplings, [&](int row, int column, const Block& block) {
        for (int r = 0; r < 2; ++r)
            for (int c = 0; c < 2; ++c)
                if (const int i = 2 * row + r, j = 2 * column + c; j >= i)
                    pattern_.block_at(A_, i, j) += block.block<3, 3>(3 * r, 3 * c).transpose();
    });
    has_places_ = !couplings.empty() || (has_places_ && !is_new_);
    is_new_ = false;
    cholesky_.factorize(A_);
}

/// Calls visit(row, column, block) for the blocks at and right of the diagonal: those of the matrices, then
/// those of the couplings.
template <class Visit>
void CoarsestSolve::for_each_block(const CouplingMatrix<6>& couplings, const Visit& visit) const {
    for (std::size_t body = 0; body < matrices_.size(); ++body) {
        const BlockSparse<6, 6>& A = *matrices_[body];
        for (int i = 0; i < A.rows(); ++i) {
            const auto columns = A.columns_of(i);
            for (std::size_t k = 0; k < columns.size(); ++k)
                if (columns[k] >= i) visit(first_[body] + i, first_[body] + columns[k], A.block(i, k));
        }
    }
    for (int i = 0; i < couplings.blocks.rows(); ++i) {
        const auto columns = couplings.blocks.columns_of(i);
        for (std::size_t k = 0; k < columns.size(); ++k)
            if (columns[k] >= i)
                visit(couplings.rows[i], couplings.rows[columns[k]], couplings.blocks.block(i, k));
    }
}

void CoarsestSolve::analyze() {
    is_analyzed_ = false;
    std::vector<std::vector<int>> nodes(2 * rows());
    for (int i = 0; i < 2 * rows(); ++i)
        for (const int column : columns_[i / 2])
            for (const int j : {2 * column, 2 * column + 1})
                if (j >= i) nodes[i].push_back(j);
    pattern_ = BlockPattern(std::move(nodes));
    A_ = pattern_.zero_matrix();
    cholesky_.analyze(A_, Ordering::quick);
    is_analyzed_ = true;
}

void CoarsestSolve::solve(std::span<const float> b, std::span<float> x) {
    if (x_.size() == 0) return;
    x_ = Eigen::Map<const Eigen::VectorXf>(b.data(), x_.size()).cast<double>();
    cholesky_.solve(x_, x_);
    Eigen::Map<Eigen::VectorXf>(x.data(), x_.size()) = x_.cast<float>();
}

}  // namespace nbd
