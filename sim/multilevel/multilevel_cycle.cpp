#include "sim/multilevel/multilevel_cycle.hpp"

#include <algorithm>
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
    begin_couplings(system);
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
    turned_.resize(static_cast<std::size_t>(system.size()));
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

/// The terms of a coupling at the first level of aggregates.
void MultilevelCycle::couple_aggregates(std::span<const LevelCouplings<3>::Term> nodes,
                                        LevelCouplings<6>& out) const {
    for (const auto& [row, J] : nodes) {
        const std::size_t b = nodes_.body_of(row);
        const int node = row - nodes_.first_row(b);
        const TransferMatrix<3, 6>& P = hierarchies_[b]->fine.prolongation;
        const auto columns = P.columns_of(node);
        const Eigen::Matrix3f turned = J * rotations_[b][static_cast<std::size_t>(node)];
        for (std::size_t k = 0; k < columns.size(); ++k)
            out.add(levels_[0].first_row(b) + columns[k], turned * P.block(P.first_block(node) + k));
    }
    out.end();
}

/// The terms of a coupling at the level after `level`.
void MultilevelCycle::couple_coarser(std::size_t level, std::span<const LevelCouplings<6>::Term> terms,
                                     LevelCouplings<6>& out) const {
    for (const auto& [row, J] : terms) {
        const std::size_t b = levels_[level].body_of(row);
        const int aggregate = row - levels_[level].first_row(b), first = levels_[level + 1].first_row(b);
        if (!is_coarsened(b, level)) {
            out.add(first + aggregate, J);
            continue;
        }
        const TransferMatrix<6, 6>& P = rest_level(b, level).coarser.prolongation;
        const auto columns = P.columns_of(aggregate);
        for (std::size_t k = 0; k < columns.size(); ++k)
            out.add(first + columns[k], J * P.block(P.first_block(aggregate) + k));
    }
    out.end();
}

void MultilevelCycle::begin_couplings(const CoupledSystem& system) {
    constexpr std::size_t per_task = 64;
    struct Part {
        LevelCouplings<3> nodes;
        std::vector<LevelCouplings<6>> levels;
    };
    const std::size_t count = system.couplings.size();
    std::vector<Part> parts((count + per_task - 1) / per_task);
    parallel_for(
        static_cast<int>(parts.size()),
        [&](int task) {
            const auto at = static_cast<std::size_t>(task);
            Part& part = parts[at];
            part.levels.resize(levels_.size());
            for (std::size_t c = at * per_task; c < std::min(count, (at + 1) * per_task); ++c) {
                for (const CouplingTerm& t : system.terms_of(system.couplings[c]))
                    if (!t.held)
                        part.nodes.add(t.unknown / 3,
                                       static_cast<float>(t.weight) * Eigen::Matrix3f::Identity());
                part.nodes.end();
                const std::size_t own = part.nodes.count() - 1;
                couple_aggregates(part.nodes.of(own), part.levels[0]);
                for (std::size_t k = 1; k < levels_.size(); ++k)
                    couple_coarser(k - 1, part.levels[k - 1].of(own), part.levels[k]);
            }
        },
        1);
    LevelCouplings<3> at_nodes;
    for (const Part& part : parts) at_nodes.append(part.nodes);
    nodes_.begin_couplings(std::move(at_nodes));
    for (std::size_t k = 0; k < levels_.size(); ++k) {
        LevelCouplings<6> at_level;
        for (const Part& part : parts) at_level.append(part.levels[k]);
        levels_[k].begin_couplings(std::move(at_level));
    }
    if (!levels_.empty()) coarsest_.begin_couplings(levels_.back().couplings());
}

void MultilevelCycle::set_couplings(const CoupledSystem& system) {
    acting_.clear();
    for (std::size_t c = 0; c < system.couplings.size(); ++c)
        if (const Eigen::Matrix3d& A = system.couplings[c].A; !A.isZero(0))
            acting_.push_back({c, A.cast<float>()});
    nodes_.set_acting(acting_);
    for (std::size_t k = 0; k + 1 < levels_.size(); ++k) levels_[k].set_acting(acting_);
    coarsest_.set_acting(acting_);
}

void MultilevelCycle::restrict_nodes() {
    using Point = Eigen::Map<Eigen::Vector3f>;
    for (std::size_t b = 0; b < hierarchies_.size(); ++b) {
        const int first = nodes_.first_row(b), nodes = nodes_.first_row(b + 1) - first;
        parallel_for(nodes, [&](int i) {
            Point(turned_.data() + 3 * (first + i)) = rotations_[b][static_cast<std::size_t>(i)].transpose() *
                                                      Point(nodes_.residual.data() + 3 * (first + i));
        });
        hierarchies_[b]->fine.restriction.multiply(turned_.data() + 3 * first,
                                                   levels_[0].b.data() + 6 * levels_[0].first_row(b));
    }
}

void MultilevelCycle::prolong_to_nodes() {
    for (std::size_t b = 0; b < hierarchies_.size(); ++b) {
        const int first = nodes_.first_row(b);
        const TransferMatrix<3, 6>& P = hierarchies_[b]->fine.prolongation;
        const float* from = levels_[0].z.data() + 6 * levels_[0].first_row(b);
        parallel_for(P.rows(), [&](int i) {
            const auto row = P.times(i, from);
            Eigen::Map<Eigen::Vector3f>(nodes_.correction.data() + 3 * (first + i)) =
                rotations_[b][static_cast<std::size_t>(i)] * Eigen::Vector3f(row[0], row[1], row[2]);
        });
    }
}

/// to = transfer times from, body by body; `transfer` is that of a body's level to the next or back. `from`
/// and `to` belong to level k and the next, in either order.
void MultilevelCycle::move_between(std::size_t k, TransferMatrix<6, 6> Transfer<6>::*transfer,
                                   std::span<const float> from, std::span<float> to) const {
    const bool down = transfer == &Transfer<6>::restriction;
    const Level &source = levels_[down ? k : k + 1], &target = levels_[down ? k + 1 : k];
    for (std::size_t b = 0; b < hierarchies_.size(); ++b) {
        const float* part = from.data() + 6 * source.first_row(b);
        float* out = to.data() + 6 * target.first_row(b);
        if (is_coarsened(b, k))
            (rest_level(b, k).coarser.*transfer).multiply(part, out);
        else
            std::copy_n(part, 6 * (source.first_row(b + 1) - source.first_row(b)), out);
    }
}

void MultilevelCycle::apply(const Eigen::VectorXf& r, Eigen::VectorXf& z) {
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
