#include "sim/multilevel/coupling_sum.hpp"

#include <algorithm>
#include <cmath>
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
    list_weights(system);
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

/// Calls visit(term) for the free nodes of a coupling, if it has acted.
template <class Visit>
void CouplingSum::for_each_term(const CoupledSystem& system, std::size_t coupling, const Visit& visit) const {
    if (!acted_[coupling]) return;
    for (const CouplingTerm& t : system.terms_of(system.couplings[coupling]))
        if (!t.held) visit(t);
}

void CouplingSum::number_rows(const CoupledSystem& system) {
    row_of_.assign(system.node_count(), -1);
    for (std::size_t c = 0; c < acted_.size(); ++c)
        for_each_term(system, c, [&](const CouplingTerm& t) { row_of_[t.unknown / 3] = 0; });
    matrix_.rows.clear();
    for (std::size_t i = 0; i < row_of_.size(); ++i) {
        if (row_of_[i] < 0) continue;
        row_of_[i] = matrix_.rows.size();
        matrix_.rows.push_back(i);
    }
}

void CouplingSum::list_weights(const CoupledSystem& system) {
    weights_ = {};
    weights_.columns = matrix_.rows.size();
    totals_.assign(acted_.size(), 0);
    for (std::size_t c = 0; c < acted_.size(); ++c) {
        for_each_term(system, c, [&](const CouplingTerm& t) {
            weights_.column.push_back(row_of_[t.unknown / 3]);
            weights_.blocks.emplace_back(t.weight);
            totals_[c] += std::abs(t.weight);
        });
        weights_.end_row();
    }
    of_rows_ = transpose(weights_);
}

/// The columns of every row, ascending.
std::vector<std::vector<int>> CouplingSum::columns() const {
    std::vector<std::vector<int>> columns(matrix_.rows.size());
    for_row_ranges(columns.size(), [&](int begin, int end) {
        std::vector<int> listed(columns.size(), -1);  // last row that has each column
        for (int i = begin; i < end; ++i) {
            std::vector<int>& row = columns[i];
            for (const int coupling : of_rows_.columns_of(i))
                for (const int other : weights_.columns_of(coupling))
                    if (std::exchange(listed[other], i) != i) row.push_back(other);
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
            const auto couplings = of_rows_.columns_of(i);
            for (std::size_t k = 0; k < couplings.size(); ++k) {
                const std::size_t c = couplings[k];
                if (strengths_[c] == 0) continue;
                const Eigen::Matrix3d& A = system.couplings[c].A;
                const double own = of_rows_.block(i, k).value(), w = std::abs(own), others = totals_[c] - w;
                damping += (w * w + CouplingMatrix<3>::damping_share * w * others) * A;
                const Eigen::Matrix3d weighted = own * A;
                const auto other_rows = weights_.columns_of(couplings[k]);
                for (std::size_t l = 0; l < other_rows.size(); ++l)
                    blocks.blocks[place[other_rows[l]]] += weights_.block(couplings[k], l).value() * weighted;
            }
        }
    });
}

}  // namespace nbd
