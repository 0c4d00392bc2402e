#include "sim/multilevel/multilevel_cycle.hpp"

#include <algorithm>
#include <cassert>
#include <climits>
#include <utility>

#include "meshing/parallel/parallel_for.hpp"

namespace nbd {
namespace {

/// Chooses how many levels of each body are used, so that the last ones have few enough aggregates to be
/// factorised at each change of the couplings: at most RestHierarchy::coarse_enough of a body and, if coarser
/// levels reach it, four times as many of all. A coarser choice is taken only if it saves a fifth.
std::vector<std::size_t> choose_depths(const std::vector<std::shared_ptr<const RestHierarchy>>& hierarchies) {
    std::vector<std::size_t> depths;
    for (int most = RestHierarchy::coarse_enough, before = INT_MAX; most > 0; most /= 2) {
        std::vector<std::size_t> coarser;
        int total = 0;
        for (const auto& hierarchy : hierarchies) {
            coarser.push_back(hierarchy->depth(most));
            total += hierarchy->levels[coarser.back() - 1].A.rows();
        }
        if (total > 0.8 * before) continue;
        depths = std::move(coarser);
        before = total;
        if (total <= 4 * RestHierarchy::coarse_enough) break;
    }
    return depths;
}

/// Prolongations of some rows, and the rows of the coarser level from which they come.
template <int B>
struct Selection {
    BlockSparse<B, 6> prolongation;  // columns: places in `rows`
    std::vector<int> rows;           // ascending
};

/// visit(row, add) calls add(coarser row, block) for the blocks of a row of P.
template <int B, class Visit>
Selection<B> select(std::span<const int> rows, int coarser_rows, const Visit& visit) {
    Selection<B> selection;
    std::vector<int> place(coarser_rows, -1);
    for (const int row : rows) {
        visit(row, [&](int column, const auto& block) {
            selection.prolongation.column.push_back(column);
            selection.prolongation.blocks.push_back(block.template cast<double>());
            place[column] = 0;
        });
        selection.prolongation.end_row();
    }
    for (std::size_t i = 0; i < place.size(); ++i) {
        if (place[i] < 0) continue;
        place[i] = selection.rows.size();
        selection.rows.push_back(i);
    }
    for (int& column : selection.prolongation.column) column = place[column];
    selection.prolongation.columns = selection.rows.size();
    return selection;
}

}  // namespace

void MultilevelCycle::begin(const CoupledSystem& system, RestHierarchies& hierarchies) {
    std::vector<std::shared_ptr<const RestHierarchy>> found;
    for (const StepSystem& s : system.systems)
        found.push_back(hierarchies.get(s.body(), s.mass_scale(), s.stiffness_scale(), s.prescribed()));
    has_aggregates_ = has_aggregates_ && found == hierarchies_;
    hierarchies_ = std::move(found);
    begin_nodes(system);
    if (!has_aggregates_) begin_aggregates();
    has_aggregates_ = true;
    forget_couplings();
}

void MultilevelCycle::begin_nodes(const CoupledSystem& system) {
    const std::size_t count = system.systems.size();
    rotations_.resize(count);
    std::vector<CoupledLevel<3>::Diagonal> diagonals;
    std::vector<const LevelMatrix<3>*> matrices;
    for (std::size_t b = 0; b < count; ++b) {
        const StepSystem& s = system.systems[b];
        s.body().node_rotations(s.elements(), rotations_[b]);
        diagonals.emplace_back(s.matrix().diagonal());
        matrices.push_back(&s.matrix().blocks());
    }
    nodes_.begin(std::move(matrices), std::move(diagonals));
    turned_.resize(system.size());
}

/// The level of a body, whose depth may be less than that of others.
const RestLevel& MultilevelCycle::rest_level(std::size_t body, std::size_t level) const {
    return hierarchies_[body]->levels[std::min(level, depth_[body] - 1)];
}

/// Whether a body is coarsened between a level and the next; else its unknowns are the same.
bool MultilevelCycle::is_coarsened(std::size_t body, std::size_t level) const {
    return level + 1 < depth_[body];
}

void MultilevelCycle::begin_aggregates() {
    depth_ = choose_depths(hierarchies_);
    levels_.resize(depth_.empty() ? 0 : std::ranges::max(depth_));
    for (std::size_t k = 0; k < levels_.size(); ++k) {
        std::vector<const LevelMatrix<6>*> matrices;
        std::vector<Level::Diagonal> diagonals;
        for (std::size_t b = 0; b < hierarchies_.size(); ++b) {
            const RestLevel& level = rest_level(b, k);
            matrices.push_back(&level.A);
            diagonals.emplace_back(level.diagonal);
        }
        levels_[k].begin(std::move(matrices), std::move(diagonals));
    }
    std::vector<const BlockSparse<6, 6>*> coarsest;
    for (std::size_t b = 0; b < hierarchies_.size(); ++b)
        coarsest.push_back(&rest_level(b, levels_.size()).to_factorize);
    coarsest_.begin(std::move(coarsest));
}

CouplingMatrix<6> MultilevelCycle::coarsen_nodes(const CouplingMatrix<3>& couplings) const {
    Selection<3> selection = select<3>(couplings.rows, levels_[0].rows(), [&](int row, const auto& add) {
        const std::size_t b = nodes_.body_of(row);
        const int node = row - nodes_.first_row(b);
        const TransferMatrix<3, 6>& P = hierarchies_[b]->fine.prolongation;
        const auto columns = P.columns_of(node);
        for (std::size_t k = 0; k < columns.size(); ++k)
            add(levels_[0].first_row(b) + columns[k],
                Eigen::Matrix<float, 3, 6>(rotations_[b][node] * P.block(node, k)));
    });
    return coarsen(couplings, selection.prolongation, std::move(selection.rows));
}

/// The couplings at the level after `level`.
CouplingMatrix<6> MultilevelCycle::coarsen_level(std::size_t level,
                                                 const CouplingMatrix<6>& couplings) const {
    const Level &from = levels_[level], &to = levels_[level + 1];
    Selection<6> selection = select<6>(couplings.rows, to.rows(), [&](int row, const auto& add) {
        const std::size_t b = from.body_of(row);
        const int aggregate = row - from.first_row(b), first = to.first_row(b);
        if (!is_coarsened(b, level)) {
            add(first + aggregate, Eigen::Matrix<float, 6, 6>::Identity().eval());
            return;
        }
        const TransferMatrix<6, 6>& P = rest_level(b, level).coarser.prolongation;
        const auto columns = P.columns_of(aggregate);
        for (std::size_t k = 0; k < columns.size(); ++k) add(first + columns[k], P.block(aggregate, k));
    });
    return coarsen(couplings, selection.prolongation, std::move(selection.rows));
}

void MultilevelCycle::forget_couplings() {
    for (Level& level : levels_) level.set_couplings({});
    coarsest_.begin_couplings();
    strengths_.reset();
}

void MultilevelCycle::set_couplings(const CouplingSum& couplings) {
    nodes_.set_couplings(couplings.matrix());
    if (!follows(couplings.strengths())) return;
    strengths_ = couplings.strengths();
    if (levels_.empty()) return;
    CouplingMatrix<6> coarser = coarsen_nodes(couplings.matrix());
    for (std::size_t k = 0; k + 1 < levels_.size(); ++k) {
        levels_[k].set_couplings(coarser);
        coarser = coarsen_level(k, coarser);
    }
    coarsest_.set_couplings(coarser);
}

/// Whether the coarser levels have to follow: more than a fifth of the couplings that act are others than
/// those they have, or more than twice as strong or weak.
bool MultilevelCycle::follows(const std::vector<double>& strengths) const {
    if (!strengths_) return true;
    std::ptrdiff_t acting = 0, others = 0;
    for (std::size_t c = 0; c < strengths.size(); ++c) {
        const auto [weaker, stronger] = std::minmax(strengths[c], (*strengths_)[c]);
        acting += strengths[c] > 0;
        others += stronger > 2 * weaker;
    }
    return 5 * others > acting;
}

void MultilevelCycle::restrict_nodes() {
    using Point = Eigen::Map<Eigen::Vector3f>;
    nodes_.for_rows([&](std::size_t b, RowRange rows) {
        for (int i = rows.begin; i < rows.end; ++i) {
            const int at = 3 * (nodes_.first_row(b) + i);
            Point(turned_.data() + at) = rotations_[b][i].transpose() * Point(nodes_.residual.data() + at);
        }
    });
    levels_[0].for_rows([&](std::size_t b, RowRange rows) {
        hierarchies_[b]->fine.restriction.multiply(rows, turned_.data() + 3 * nodes_.first_row(b),
                                                   levels_[0].b.data() + 6 * levels_[0].first_row(b));
    });
}

void MultilevelCycle::prolong_to_nodes() {
    nodes_.for_rows([&](std::size_t b, RowRange rows) {
        const TransferMatrix<3, 6>& P = hierarchies_[b]->fine.prolongation;
        const float* from = levels_[0].z.data() + 6 * levels_[0].first_row(b);
        for (int i = rows.begin; i < rows.end; ++i) {
            const auto row = P.times(i, from);
            Eigen::Map<Eigen::Vector3f>(nodes_.correction.data() + 3 * (nodes_.first_row(b) + i)) =
                rotations_[b][i] * Eigen::Vector3f(row[0], row[1], row[2]);
        }
    });
}

/// to = transfer times from, body by body; `transfer` is that of a body's level to the next or back. `from`
/// and `to` belong to level k and the next, in either order.
void MultilevelCycle::move_between(std::size_t k, TransferMatrix<6, 6> Transfer<6>::*transfer,
                                   std::span<const float> from, std::span<float> to) const {
    const bool down = transfer == &Transfer<6>::restriction;
    const Level &source = levels_[down ? k : k + 1], &target = levels_[down ? k + 1 : k];
    target.for_rows([&](std::size_t b, RowRange rows) {
        const float* part = from.data() + 6 * source.first_row(b);
        float* out = to.data() + 6 * target.first_row(b);
        if (is_coarsened(b, k))
            (rest_level(b, k).coarser.*transfer).multiply(rows, part, out);
        else
            std::copy(part + 6 * rows.begin, part + 6 * rows.end, out + 6 * rows.begin);
    });
}

void MultilevelCycle::apply(const Eigen::VectorXf& r, Eigen::VectorXf& z) {
    assert(strengths_);
    nodes_.b.assign(r.begin(), r.end());
    nodes_.smooth_from_zero();
    restrict_nodes();
    const std::size_t last = levels_.size() - 1;
    for (std::size_t k = 0; k < last; ++k) {
        levels_[k].smooth_from_zero();
        move_between(k, &Transfer<6>::restriction, levels_[k].residual, levels_[k + 1].b);
    }
    coarsest_.solve(levels_.back().b, levels_.back().z);
    for (std::size_t k = last; k-- > 0;) {
        move_between(k, &Transfer<6>::prolongation, levels_[k + 1].z, levels_[k].correction);
        levels_[k].correct_and_smooth();
    }
    prolong_to_nodes();
    nodes_.correct_and_smooth();
    std::ranges::copy(nodes_.z, z.begin());
}

void MultilevelCycle::take_residual(Eigen::VectorXf& residual) {
    nodes_.take_residual();
    std::ranges::copy(nodes_.residual, residual.begin());
}

}  // namespace nbd
