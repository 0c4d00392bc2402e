#include "sim/solvers/patch_factor.hpp"

#include <algorithm>

namespace nbd {
namespace {

/// Finds the body and local node of a system node. Nodes must be passed in ascending order.
class BodyOf {
 public:
    explicit BodyOf(const CoupledSystem& system) : first_(system.first_unknown) {}
    struct Place {
        std::size_t body;
        int node;
    };
    Place operator()(int node) {
        while (3 * node >= first_[body_ + 1]) ++body_;
        return {body_, node - first_[body_] / 3};
    }

 private:
    std::span<const int> first_;
    std::size_t body_ = 0;
};

/// Calls visit(i, j, coupling, s, t) for every pair of terms s, t of each non-zero coupling whose nodes are
/// both in the patch. i, j: their places in the patch.
template <class Visit>
void for_each_coupled_pair(const CoupledSystem& system, const std::vector<int>& slot, Visit&& visit) {
    for (const Coupling& coupling : system.couplings) {
        if (coupling.A.isZero(0)) continue;
        for (const CouplingTerm& s : system.terms_of(coupling))
            for (const CouplingTerm& t : system.terms_of(coupling)) {
                const int i = slot[static_cast<std::size_t>(s.unknown / 3)],
                          j = slot[static_cast<std::size_t>(t.unknown / 3)];
                if (i >= 0 && j >= 0) visit(i, j, coupling, s, t);
            }
    }
}

}  // namespace

std::vector<std::vector<int>> PatchFactor::adjacency(const CoupledSystem& system) const {
    std::vector<std::vector<int>> rows(nodes_.size());
    BodyOf body_of(system);
    for (std::size_t s = 0; s < nodes_.size(); ++s) {
        const auto [body, node] = body_of(nodes_[s]);
        const int first = system.first_unknown[body] / 3;
        for (const int j : system.systems[body].body().pattern().neighbours(node))
            if (const int slot = slot_[static_cast<std::size_t>(first + j)]; slot >= 0)
                rows[s].push_back(slot);
    }
    for_each_coupled_pair(
        system, slot_, [&](int i, int j, const auto&...) { rows[static_cast<std::size_t>(i)].push_back(j); });
    return rows;
}

void PatchFactor::fill(const CoupledSystem& system) {
    std::fill(A_.valuePtr(), A_.valuePtr() + A_.nonZeros(), 0.0);
    BodyOf body_of(system);
    for (int s = 0; s < node_count(); ++s) {
        const auto [body, node] = body_of(nodes_[static_cast<std::size_t>(s)]);
        const BlockPattern& pattern = system.systems[body].body().pattern();
        const SparseMatrix& A = system.systems[body].matrix();
        const int first = system.first_unknown[body] / 3;
        const auto row = pattern.neighbours(node);
        for (int k = 0; k < static_cast<int>(row.size()); ++k) {
            const int slot = slot_[static_cast<std::size_t>(first + row[static_cast<std::size_t>(k)])];
            if (slot >= 0)
                pattern_.block(A_, s, pattern_.find(s, slot) - pattern_.first_block(s)) =
                    pattern.block(A, node, k);
        }
    }
    for_each_coupled_pair(
        system, slot_,
        [&](int i, int j, const Coupling& coupling, const CouplingTerm& s, const CouplingTerm& t) {
            if (!s.held && !t.held)
                pattern_.block(A_, i, pattern_.find(i, j) - pattern_.first_block(i)) +=
                    s.weight * t.weight * coupling.A;
        });
}

void PatchFactor::factorize(const CoupledSystem& system, const std::vector<char>& inside) {
    nodes_.clear();
    slot_.assign(inside.size(), -1);
    for (int i = 0; i < static_cast<int>(inside.size()); ++i) {
        if (!inside[static_cast<std::size_t>(i)]) continue;
        slot_[static_cast<std::size_t>(i)] = node_count();
        nodes_.push_back(i);
    }
    if (nodes_.empty()) return;
    BlockPattern pattern(adjacency(system));
    if (!analyzed_ || pattern != pattern_) {
        pattern_ = std::move(pattern);
        A_ = pattern_.zero_matrix();
        analyzed_ = false;
        cholesky_.analyze(A_, ordering_);
        analyzed_ = true;
        rhs_.resize(3 * static_cast<Eigen::Index>(nodes_.size()));
    }
    fill(system);
    cholesky_.factorize(A_);
}

void PatchFactor::correct(const CoupledSystem& system, const Eigen::VectorXd& r, Eigen::VectorXd& v) {
    if (empty()) return;
    product_.resize(system.size());
    BodyOf body_of(system);
    for (const int i : nodes_) {
        const auto [body, node] = body_of(i);
        product_.segment<3>(3 * i) = system.systems[body].body().pattern().multiply_row(
            system.systems[body].matrix(), node, v.data() + system.first_unknown[body]);
    }
    system.add_couplings(v, product_);
    for (Eigen::Index s = 0; s < node_count(); ++s) {
        const int i = 3 * nodes_[static_cast<std::size_t>(s)];
        rhs_.segment<3>(3 * s) = r.segment<3>(i) - product_.segment<3>(i);
    }
    add_patch_solution(v);
}

void PatchFactor::add_solution(const Eigen::VectorXd& r, Eigen::VectorXd& v) {
    if (empty()) return;
    for (Eigen::Index s = 0; s < node_count(); ++s)
        rhs_.segment<3>(3 * s) = r.segment<3>(3 * nodes_[static_cast<std::size_t>(s)]);
    add_patch_solution(v);
}

void PatchFactor::add_patch_solution(Eigen::VectorXd& v) {
    cholesky_.solve(rhs_, rhs_);
    for (Eigen::Index s = 0; s < node_count(); ++s)
        v.segment<3>(3 * nodes_[static_cast<std::size_t>(s)]) += rhs_.segment<3>(3 * s);
}

}  // namespace nbd
