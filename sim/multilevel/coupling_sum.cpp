#include "sim/multilevel/coupling_sum.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "meshing/parallel/parallel_for.hpp"

namespace nbd {
namespace {

std::size_t diagonal_at(const BlockSparse<6, 6>& blocks, int row) {
    const auto columns = blocks.columns_of(row);
    return std::ranges::lower_bound(columns, row) - columns.begin();
}

/// C without its diagonal blocks is bounded entry by entry, with t from the diagonal.
void set_damping(CouplingMatrix<6>& C) {
    using Column = Eigen::Matrix<double, 6, 1>;
    const int count = C.rows.size();
    std::vector<Column> roots;  // of the diagonal
    for (int i = 0; i < count; ++i)
        roots.push_back(C.blocks.block(i, diagonal_at(C.blocks, i)).diagonal().cwiseMax(0).cwiseSqrt());
    C.damping.resize(C.rows.size());
    parallel_for(
        count,
        [&](int i) {
            const Column& own = roots[i];
            Column bound = Column::Zero();
            const auto columns = C.blocks.columns_of(i);
            for (std::size_t k = 0; k < columns.size(); ++k) {
                if (columns[k] == i) continue;
                const Column& other = roots[columns[k]];
                for (int q = 0; q < 6; ++q)
                    if (other[q] > 0)
                        bound += (C.blocks.block(i, k).col(q).cwiseAbs().cwiseProduct(own) / other[q])
                                     .cwiseMin(own.cwiseAbs2());
            }
            CouplingMatrix<6>::Square& damping = C.damping[i];
            damping = C.blocks.block(i, diagonal_at(C.blocks, i));
            damping.diagonal() += CouplingMatrix<6>::damping_share * bound;
        },
        32);
}

}  // namespace

template <int B>
CouplingMatrix<6> coarsen(const CouplingMatrix<B>& C, const BlockSparse<B, 6>& prolongation,
                          std::vector<int> rows) {
    CouplingMatrix<6> coarser;
    coarser.rows = std::move(rows);
    coarser.blocks = product(transpose(prolongation), product(C.blocks, prolongation));
    set_damping(coarser);
    return coarser;
}

template CouplingMatrix<6> coarsen(const CouplingMatrix<3>&, const BlockSparse<3, 6>&, std::vector<int>);
template CouplingMatrix<6> coarsen(const CouplingMatrix<6>&, const BlockSparse<6, 6>&, std::vector<int>);

namespace {

/// Calls visit(begin, end) for ranges of rows, in parallel.
template <class Visit>
void for_row_ranges(int rows, const Visit& visit) {
    const int per_task = std::max(32, rows / 64);  // each visit has an array of all columns
    parallel_for((rows + per_task - 1) / per_task,
                 [&](int task) { visit(task * per_task, std::min(rows, (task + 1) * per_task)); }, 1);
}

}  // namespace

void CouplingSum::begin(const CoupledSystem& system) {
    strengths_.assign(system.couplings.size(), 0);
    acted_.assign(system.couplings.size(), 0);
    analyze(system);
}

void CouplingSum::update(const CoupledSystem& system) {
    bool has_grown = false;
    for (std::size_t c = 0; c < strengths_.size(); ++c) {
        strengths_[c] = system.couplings[c].A.trace();
        if (strengths_[c] != 0 && !acted_[c]) acted_[c] = has_grown = true;
    }
    if (has_grown) analyze(system);
    fill(system);
}

void CouplingSum::analyze(const CoupledSystem& system) {
    ++pattern_;
    number_rows(system);
    list_terms(system);
    BlockSparse<3, 3>& blocks = matrix_.blocks;
    blocks = {};
    blocks.columns = matrix_.rows.size();
    for (const std::vector<int>& row : columns()) {
        blocks.column.insert(blocks.column.end(), row.begin(), row.end());
        blocks.end_row();
    }
    blocks.blocks.resize(blocks.column.size());
    matrix_.damping.resize(matrix_.rows.size());
}

/// Calls visit(coupling, term) for the terms of the couplings that have acted.
template <class Visit>
void CouplingSum::for_each_term(const CoupledSystem& system, const Visit& visit) const {
    for (std::size_t c = 0; c < acted_.size(); ++c)
        if (acted_[c])
            for (const CouplingTerm& t : system.terms_of(system.couplings[c]))
                if (!t.held) visit(c, t);
}

void CouplingSum::number_rows(const CoupledSystem& system) {
    row_of_.assign(system.node_count(), -1);
    for_each_term(system, [&](std::size_t, const CouplingTerm& t) { row_of_[t.unknown / 3] = 0; });
    matrix_.rows.clear();
    for (std::size_t i = 0; i < row_of_.size(); ++i) {
        if (row_of_[i] < 0) continue;
        row_of_[i] = matrix_.rows.size();
        matrix_.rows.push_back(i);
    }
}

void CouplingSum::list_terms(const CoupledSystem& system) {
    terms_.clear();
    totals_.assign(acted_.size(), 0);
    first_term_.assign(acted_.size() + 1, 0);
    first_at_.assign(matrix_.rows.size() + 1, 0);
    for_each_term(system, [&](std::size_t c, const CouplingTerm& t) {
        const int row = row_of_[t.unknown / 3];
        terms_.push_back({row, static_cast<int>(c), t.weight});
        totals_[c] += std::abs(t.weight);
        ++first_term_[c + 1];
        ++first_at_[row + 1];
    });
    std::partial_sum(first_term_.begin(), first_term_.end(), first_term_.begin());
    std::partial_sum(first_at_.begin(), first_at_.end(), first_at_.begin());
    at_.resize(terms_.size());
    std::vector<int> next(first_at_.begin(), first_at_.end() - 1);
    for (std::size_t t = 0; t < terms_.size(); ++t) at_[next[terms_[t].row]++] = t;
}

std::span<const int> CouplingSum::terms_at(int row) const noexcept {
    const std::size_t i = row;
    return std::span(at_).subspan(first_at_[i], first_at_[i + 1] - first_at_[i]);
}

std::span<const CouplingSum::Term> CouplingSum::terms_of(int coupling) const noexcept {
    const std::size_t c = coupling;
    return std::span(terms_).subspan(first_term_[c], first_term_[c + 1] - first_term_[c]);
}

/// The columns of every row, ascending.
std::vector<std::vector<int>> CouplingSum::columns() const {
    std::vector<std::vector<int>> columns(matrix_.rows.size());
    for_row_ranges(columns.size(), [&](int begin, int end) {
        std::vector<int> listed(columns.size(), -1);  // last row that has each column
        for (int i = begin; i < end; ++i) {
            std::vector<int>& row = columns[i];
            for (const int own : terms_at(i))
                for (const Term& other : terms_of(terms_[own].coupling))
                    if (std::exchange(listed[other.row], i) != i) row.push_back(other.row);
            std::ranges::sort(row);
        }
    });
    return columns;
}

/// Damping: |w_i v_i . A w_j v_j| <= |w_i w_j| (v_i . A v_i + v_j . A v_j) / 2 for each pair of nodes of a
/// coupling.
void CouplingSum::fill(const CoupledSystem& system) {
    BlockSparse<3, 3>& blocks = matrix_.blocks;
    for_row_ranges(blocks.rows(), [&](int begin, int end) {
        std::vector<std::size_t> place(matrix_.rows.size());  // of each column of the row
        for (int i = begin; i < end; ++i) {
            const std::size_t first = blocks.offset[i];
            const auto row = blocks.columns_of(i);
            for (std::size_t k = 0; k < row.size(); ++k) {
                place[row[k]] = first + k;
                blocks.blocks[first + k].setZero();
            }
            Eigen::Matrix3d& damping = matrix_.damping[i];
            damping.setZero();
            for (const int at : terms_at(i)) {
                const Term& own = terms_[at];
                const std::size_t c = own.coupling;
                if (strengths_[c] == 0) continue;
                const Eigen::Matrix3d& A = system.couplings[c].A;
                const double w = std::abs(own.weight), others = totals_[c] - w;
                damping += (w * w + CouplingMatrix<3>::damping_share * w * others) * A;
                const Eigen::Matrix3d weighted = own.weight * A;
                for (const Term& other : terms_of(own.coupling))
                    blocks.blocks[place[other.row]] += other.weight * weighted;
            }
        }
    });
}

}  // namespace nbd
