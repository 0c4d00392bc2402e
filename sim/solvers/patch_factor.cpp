#include "sim/solvers/patch_factor.hpp"

#include <algorithm>
#include <utility>

#include "meshing/parallel/parallel_for.hpp"

namespace nbd {
namespace {

/// The body and local node of a system node.
struct Place {
    std::size_t body;
    int node;
};

Place place_of(const CoupledSystem& system, int node) {
    const auto after = std::ranges::upper_bound(system.first_unknown, 3 * node);
    const std::size_t body = after - system.first_unknown.begin() - 1;
    return {body, node - system.first_unknown[body] / 3};
}

}  // namespace

/// Calls visit(j, block) for the blocks in rows of nodes j >= s of the patch and the column of node s: those
/// of the bodies' matrices, then those of the couplings.
template <class Visit>
void PatchFactor::for_each_block(const CoupledSystem& system, const CouplingSum& couplings, int s,
                                 const Visit& visit) const {
    const int own = nodes_[s];
    const auto [body, node] = place_of(system, own);
    const StepMatrix& matrix = system.systems[body].matrix();
    const int first = system.first_unknown[body] / 3;
    const auto near = system.systems[body].body().pattern().neighbours(node);
    for (int k = 0; k < std::ssize(near); ++k)
        if (const int j = slot_[first + near[k]]; j >= s) visit(j, matrix.block(node, k).transpose());
    const int row = couplings.row_of(own);
    if (row < 0) return;
    const CouplingMatrix<3>& C = couplings.matrix();
    const auto columns = C.blocks.columns_of(row);
    for (std::size_t k = 0; k < columns.size(); ++k)
        if (const int j = slot_[C.rows[columns[k]]]; j >= s) visit(j, C.blocks.block(row, k).transpose());
}

/// Whether the pattern has the couplings, and the nodes inside.
bool PatchFactor::is_covered(const CouplingSum& couplings, const std::vector<char>& inside) const {
    if (is_new_ || couplings.pattern() != coupled_by_) return false;
    for (std::size_t i = 0; i < inside.size(); ++i)
        if (inside[i] && slot_[i] < 0) return false;
    return true;
}

/// The lower half: for each node of the patch its neighbours there that do not come before it.
BlockPattern PatchFactor::lower_half(const CoupledSystem& system, const CouplingSum& couplings) const {
    std::vector<std::vector<int>> rows(nodes_.size());
    for (int s = 0; s < node_count(); ++s)
        for_each_block(system, couplings, s, [&](int j, const auto&) { rows[s].push_back(j); });
    return BlockPattern(std::move(rows));
}

/// Lets the patch grow to the nodes inside, or makes it anew if it is the first since begin(), and analyses
/// its pattern. Nodes are kept in the order in which they are eliminated.
void PatchFactor::analyze(const CoupledSystem& system, const CouplingSum& couplings,
                          const std::vector<char>& inside) {
    if (is_new_) slot_.assign(inside.size(), -1);
    nodes_.clear();
    for (int i = 0; i < std::ssize(inside); ++i) {
        int& slot = slot_[i];
        if (!inside[i] && slot < 0) continue;
        slot = node_count();
        nodes_.push_back(i);
    }
    if (nodes_.empty()) return;
    find_border(system);
    spread_.setZero(system.size());
    BlockPattern ascending = lower_half(system, couplings);
    const bool is_known = analyzed_ && ascending == ascending_;
    if (!is_known) {
        analyzed_ = false;
        ascending_ = std::move(ascending);
        order_ = elimination_order(ascending_, ordering_);
    }
    const std::vector<int> members = nodes_;
    for (std::size_t k = 0; k < order_.size(); ++k) {
        nodes_[k] = members[order_[k]];
        slot_[nodes_[k]] = static_cast<int>(k);
    }
    if (!is_known) {
        pattern_ = lower_half(system, couplings);
        A_ = pattern_.zero_matrix();
        cholesky_.analyze(A_, Ordering::given);
        analyzed_ = true;
        solution_.resize(3 * nodes_.size());
    }
    places_.clear();
    for (int s = 0; s < node_count(); ++s)
        for_each_block(system, couplings, s, [&](int j, const auto&) {
            places_.push_back(pattern_.find(s, j) - pattern_.first_block(s));
        });
}

/// Couplings do not reach the border: one that acts on two or more nodes lies in the patch.
void PatchFactor::find_border(const CoupledSystem& system) {
    std::vector<char> is_border(slot_.size(), 0);
    for (const int i : nodes_) {
        const auto [body, node] = place_of(system, i);
        const int first = system.first_unknown[body] / 3;
        for (const int near : system.systems[body].body().pattern().neighbours(node))
            is_border[first + near] = 1;
    }
    border_.clear();
    for (int i = 0; i < std::ssize(slot_); ++i)
        if (is_border[i] && slot_[i] < 0) border_.push_back(i);
}

bool PatchFactor::factorize(const CoupledSystem& system, const CouplingSum& couplings,
                            const std::vector<char>& inside) {
    if (!is_covered(couplings, inside)) analyze(system, couplings, inside);
    is_new_ = false;
    coupled_by_ = couplings.pattern();
    if (nodes_.empty()) return true;
    A_.coeffs().setZero();
    auto place = places_.begin();
    for (int s = 0; s < node_count(); ++s)
        for_each_block(system, couplings, s,
                       [&](int, const auto& block) { pattern_.block(A_, s, *place++) += block; });
    return cholesky_.try_factorize(A_);
}

void PatchFactor::factorize_nearly(const CoupledSystem& system, const CouplingSum& couplings,
                                   const std::vector<char>& inside) {
    if (factorize(system, couplings, inside)) return;
    for (const double more : {1e-7, 1e-5, 1e-3}) {
        A_.diagonal() *= 1 + more;
        if (cholesky_.try_factorize(A_)) return;
    }
    cholesky_.factorize(A_);
}

void PatchFactor::take_residual(const CoupledSystem& system, const CouplingSum& couplings,
                                const Eigen::VectorXd& v, Eigen::VectorXd& r) const {
    const CouplingMatrix<3>& C = couplings.matrix();
    parallel_for(
        node_count(),
        [&](int s) {
            const int own = nodes_[s];
            const auto [body, node] = place_of(system, own);
            Eigen::Vector3d product =
                system.systems[body].matrix().multiply_row(node, v.data() + system.first_unknown[body]);
            if (const int row = couplings.row_of(own); row >= 0) {
                const auto columns = C.blocks.columns_of(row);
                for (std::size_t k = 0; k < columns.size(); ++k)
                    product += C.blocks.block(row, k) * v.segment<3>(3 * C.rows[columns[k]]);
            }
            r.segment<3>(3 * own) = -product;
        },
        64);
}

void PatchFactor::clear(const CoupledSystem& system, Eigen::VectorXd& r, Eigen::VectorXd& v) {
    if (empty()) return;
    solve(r);
    for (Eigen::Index s = 0; s < node_count(); ++s) {
        const int i = 3 * nodes_[s];
        v.segment<3>(i) += solution_.segment<3>(3 * s);
        spread_.segment<3>(i) = solution_.segment<3>(3 * s);
        r.segment<3>(i).setZero();
    }
    parallel_for(border_.size(), [&](int k) {
        const int i = border_[k];
        const auto [body, node] = place_of(system, i);
        r.segment<3>(3 * i) -=
            system.systems[body].matrix().multiply_row(node, spread_.data() + system.first_unknown[body]);
    });
}

void PatchFactor::add_solution(const Eigen::VectorXd& r, Eigen::VectorXd& v) {
    if (empty()) return;
    solve(r);
    for (Eigen::Index s = 0; s < node_count(); ++s)
        v.segment<3>(3 * nodes_[s]) += solution_.segment<3>(3 * s);
}

/// solution_ = A_S^-1 r_S.
void PatchFactor::solve(const Eigen::VectorXd& r) {
    for (Eigen::Index s = 0; s < node_count(); ++s) solution_.segment<3>(3 * s) = r.segment<3>(3 * nodes_[s]);
    cholesky_.solve(solution_, solution_);
}

}  // namespace nbd
