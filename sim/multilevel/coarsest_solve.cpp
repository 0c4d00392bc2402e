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
    couplings_ = nullptr;
    acted_.clear();
    is_new_ = has_couplings_ = true;
    set_acting({});
}

void CoarsestSolve::begin_couplings(const LevelCouplings<6>& couplings) {
    couplings_ = &couplings;
    acted_.assign(couplings.count(), 0);
    is_new_ = true;
}

void CoarsestSolve::set_acting(std::span<const ActingCoupling> acting) {
    if (rows() == 0 || (acting.empty() && !has_couplings_)) return;
    for (const ActingCoupling& coupling : acting) acted_[coupling.index] = 1;
    if (is_new_ || !fill(acting)) {
        analyze();
        fill(acting);
    }
    is_new_ = false;
    has_couplings_ = !acting.empty();
    cholesky_.factorize(A_);
}

void CoarsestSolve::analyze() {
    std::vector<std::vector<int>> nodes(static_cast<std::size_t>(2 * rows()));
    const auto add_place = [&](int row, int column) {
        for (const int i : {2 * row, 2 * row + 1})
            for (const int j : {2 * column, 2 * column + 1})
                if (j >= i) nodes[static_cast<std::size_t>(i)].push_back(j);
    };
    for (std::size_t body = 0; body < matrices_.size(); ++body)
        for (int i = 0; i < matrices_[body]->rows(); ++i)
            for (const int column : matrices_[body]->columns_of(i))
                add_place(first_[body] + i, first_[body] + column);
    for (std::size_t c = 0; c < acted_.size(); ++c) {
        if (!acted_[c]) continue;
        for (const auto& to : couplings_->of(c))
            for (const auto& from : couplings_->of(c)) add_place(from.row, to.row);
    }
    pattern_ = BlockPattern(std::move(nodes));
    A_ = pattern_.zero_matrix();
    cholesky_.analyze(A_, Ordering::quick);
}

/// Adds a block at or right of the diagonal. Returns false if the pattern has no place for it.
bool CoarsestSolve::add(int row, int column, const Block& block) {
    for (int r = 0; r < 2; ++r)
        for (int c = 0; c < 2; ++c) {
            const int i = 2 * row + r, j = 2 * column + c;
            if (j < i) continue;
            const int at = pattern_.find(i, j);
            if (at < 0) return false;
            pattern_.block(A_, i, at - pattern_.first_block(i)) +=
                block.block<3, 3>(3 * r, 3 * c).transpose();
        }
    return true;
}

/// Returns false if the pattern has no place for one of the couplings.
bool CoarsestSolve::fill(std::span<const ActingCoupling> acting) {
    std::fill_n(A_.valuePtr(), A_.nonZeros(), 0.0);
    for (std::size_t body = 0; body < matrices_.size(); ++body)
        for (int i = 0; i < matrices_[body]->rows(); ++i) {
            const auto columns = matrices_[body]->columns_of(i);
            for (std::size_t k = 0; k < columns.size(); ++k)
                if (columns[k] >= i)
                    add(first_[body] + i, first_[body] + columns[k], matrices_[body]->block(i, k));
        }
    for (const ActingCoupling& coupling : acting) {
        const auto terms = couplings_->of(coupling.index);
        for (const auto& to : terms) {
            const Eigen::Matrix<float, 3, 6> AJ = coupling.A * to.J;
            for (const auto& from : terms) {
                if (from.row > to.row) continue;
                const Eigen::Matrix<float, 6, 6> block = from.J.transpose() * AJ;
                if (!add(from.row, to.row, block.cast<double>())) return false;
            }
        }
    }
    return true;
}

void CoarsestSolve::solve(std::span<const float> b, std::span<float> x) {
    if (x_.size() == 0) return;
    x_ = Eigen::Map<const Eigen::VectorXf>(b.data(), x_.size()).cast<double>();
    cholesky_.solve(x_, x_);
    Eigen::Map<Eigen::VectorXf>(x.data(), x_.size()) = x_.cast<float>();
}

}  // namespace nbd
