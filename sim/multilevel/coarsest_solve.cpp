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
    if (is_new_) rows_.assign(rows(), {});
    if (sum(couplings) || !is_analyzed_) analyze();
    fill();
    has_places_ = !couplings.empty() || (has_places_ && !is_new_);
    is_new_ = false;
    cholesky_.factorize(A_);
}

/// Adds a block. Returns whether it has a new place.
bool CoarsestSolve::add(int row, int column, const Block& block) {
    Row& to = rows_[row];
    const auto known = std::ranges::find(to.columns, column);
    if (known != to.columns.end()) {
        to.blocks[known - to.columns.begin()] += block;
        return false;
    }
    to.columns.push_back(column);
    to.blocks.push_back(block);
    return true;
}

/// Adds up the matrices and couplings. Returns whether blocks got new places.
bool CoarsestSolve::sum(const CouplingMatrix<6>& couplings) {
    for (Row& row : rows_) std::ranges::fill(row.blocks, Block::Zero());
    bool has_grown = false;
    for (std::size_t body = 0; body < matrices_.size(); ++body) {
        const BlockSparse<6, 6>& A = *matrices_[body];
        const int first = first_[body];
        for (int i = 0; i < A.rows(); ++i) {
            const auto columns = A.columns_of(i);
            for (std::size_t k = 0; k < columns.size(); ++k)
                if (columns[k] >= i) has_grown |= add(first + i, first + columns[k], A.block(i, k));
        }
    }
    for (int i = 0; i < couplings.blocks.rows(); ++i) {
        const auto columns = couplings.blocks.columns_of(i);
        for (std::size_t k = 0; k < columns.size(); ++k)
            if (columns[k] >= i)
                has_grown |= add(couplings.rows[i], couplings.rows[columns[k]], couplings.blocks.block(i, k));
    }
    return has_grown;
}

void CoarsestSolve::analyze() {
    is_analyzed_ = false;
    std::vector<std::vector<int>> nodes(2 * rows());
    for (int i = 0; i < 2 * rows(); ++i)
        for (const int column : rows_[i / 2].columns)
            for (const int j : {2 * column, 2 * column + 1})
                if (j >= i) nodes[i].push_back(j);
    pattern_ = BlockPattern(std::move(nodes));
    A_ = pattern_.zero_matrix();
    cholesky_.analyze(A_, Ordering::quick);
    is_analyzed_ = true;
}

/// Copies the sum to the matrix of the factor.
void CoarsestSolve::fill() {
    for (int i = 0; i < 2 * rows(); ++i) {
        const Row& row = rows_[i / 2];
        for (std::size_t k = 0; k < row.columns.size(); ++k)
            for (int c = 0; c < 2; ++c)
                if (const int j = 2 * row.columns[k] + c; j >= i)
                    pattern_.block(A_, i, pattern_.find(i, j) - pattern_.first_block(i)) =
                        row.blocks[k].block<3, 3>(3 * (i % 2), 3 * c).transpose();
    }
}

void CoarsestSolve::solve(std::span<const float> b, std::span<float> x) {
    if (x_.size() == 0) return;
    x_ = Eigen::Map<const Eigen::VectorXf>(b.data(), x_.size()).cast<double>();
    cholesky_.solve(x_, x_);
    Eigen::Map<Eigen::VectorXf>(x.data(), x_.size()) = x_.cast<float>();
}

}  // namespace nbd
