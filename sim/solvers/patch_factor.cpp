#include "sim/solvers/patch_factor.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

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

}  // namespace

/// Lists the couplings at each node of the patch that act or have acted since begin().
void PatchFactor::list_couplings(const CoupledSystem& system) {
    const auto for_each_term = [&](const auto& visit) {
        for (int c = 0; c < static_cast<int>(system.couplings.size()); ++c) {
            if (!acted_[static_cast<std::size_t>(c)]) continue;
            for (const CouplingTerm& t : system.terms_of(system.couplings[static_cast<std::size_t>(c)]))
                if (const int s = slot_[static_cast<std::size_t>(t.unknown / 3)]; s >= 0 && !t.held)
                    visit(static_cast<std::size_t>(s), CouplingAt{c, t.weight});
        }
    };
    first_coupling_.assign(nodes_.size() + 1, 0);
    for_each_term([&](std::size_t s, const CouplingAt&) { ++first_coupling_[s + 1]; });
    std::partial_sum(first_coupling_.begin(), first_coupling_.end(), first_coupling_.begin());
    couplings_.resize(static_cast<std::size_t>(first_coupling_.back()));
    std::vector<int> next(first_coupling_.begin(), first_coupling_.end() - 1);
    for_each_term(
        [&](std::size_t s, const CouplingAt& at) { couplings_[static_cast<std::size_t>(next[s]++)] = at; });
}

/// Calls visit(j, at, term) for every coupling at node s of the patch and each of its nodes j >= s there.
template <class Visit>
void PatchFactor::for_each_coupled(const CoupledSystem& system, int s, const Visit& visit) const {
    const auto i = static_cast<std::size_t>(s);
    for (int k = first_coupling_[i]; k < first_coupling_[i + 1]; ++k) {
        const CouplingAt& at = couplings_[static_cast<std::size_t>(k)];
        for (const CouplingTerm& t : system.terms_of(system.couplings[static_cast<std::size_t>(at.coupling)]))
            if (const int j = slot_[static_cast<std::size_t>(t.unknown / 3)]; j >= s && !t.held)
                visit(j, at, t);
    }
}

/// The lower half of the pattern: for each node of the patch its neighbours there that do not come before it.
std::vector<std::vector<int>> PatchFactor::adjacency(const CoupledSystem& system) const {
    std::vector<std::vector<int>> rows(nodes_.size());
    std::vector<int> listed(nodes_.size(), -1);  // last row that has each node
    BodyOf body_of(system);
    for (int s = 0; s < node_count(); ++s) {
        const auto add = [&](int j) {
            if (j >= s && std::exchange(listed[static_cast<std::size_t>(j)], s) != s)
                rows[static_cast<std::size_t>(s)].push_back(j);
        };
        const auto [body, node] = body_of(nodes_[static_cast<std::size_t>(s)]);
        const int first = system.first_unknown[body] / 3;
        for (const int j : system.systems[body].body().pattern().neighbours(node))
            add(slot_[static_cast<std::size_t>(first + j)]);
        for_each_coupled(system, s, [&](int j, const auto&...) { add(j); });
    }
    return rows;
}

void PatchFactor::fill(const CoupledSystem& system) {
    std::fill(A_.valuePtr(), A_.valuePtr() + A_.nonZeros(), 0.0);
    std::vector<int> place(nodes_.size());  // of each node in the row
    BodyOf body_of(system);
    for (int s = 0; s < node_count(); ++s) {
        const auto columns = pattern_.neighbours(s);
        for (std::size_t k = 0; k < columns.size(); ++k)
            place[static_cast<std::size_t>(columns[k])] = static_cast<int>(k);
        const auto at_place = [&](int j) {
            return pattern_.block(A_, s, place[static_cast<std::size_t>(j)]);
        };
        const auto [body, node] = body_of(nodes_[static_cast<std::size_t>(s)]);
        const BlockPattern& pattern = system.systems[body].body().pattern();
        const int first = system.first_unknown[body] / 3;
        const auto row = pattern.neighbours(node);
        for (int k = 0; k < static_cast<int>(row.size()); ++k)
            if (const int j = slot_[static_cast<std::size_t>(first + row[static_cast<std::size_t>(k)])];
                j >= s)
                at_place(j) = system.systems[body].matrix().block(node, k).transpose();
        for_each_coupled(system, s, [&](int j, const CouplingAt& at, const CouplingTerm& t) {
            at_place(j) += at.weight * t.weight * system.couplings[static_cast<std::size_t>(at.coupling)].A;
        });
    }
}

/// Notes which couplings act. Returns whether the pattern has them all, and the nodes inside.
bool PatchFactor::is_covered(const CoupledSystem& system, const std::vector<char>& inside) {
    bool covered = !is_new_;
    if (is_new_) acted_.assign(system.couplings.size(), 0);
    for (std::size_t c = 0; c < acted_.size(); ++c)
        if (!acted_[c] && !system.couplings[c].A.isZero(0)) {
            acted_[c] = 1;
            covered = false;
        }
    for (std::size_t i = 0; i < inside.size() && covered; ++i) covered = !inside[i] || slot_[i] >= 0;
    return covered;
}

/// Lets the patch grow to the nodes inside, or makes it anew if it is the first since begin(), and analyses
/// its pattern.
void PatchFactor::analyze(const CoupledSystem& system, const std::vector<char>& inside) {
    if (is_new_) slot_.assign(inside.size(), -1);
    nodes_.clear();
    for (int i = 0; i < static_cast<int>(inside.size()); ++i) {
        int& slot = slot_[static_cast<std::size_t>(i)];
        if (!inside[static_cast<std::size_t>(i)] && slot < 0) continue;
        slot = node_count();
        nodes_.push_back(i);
    }
    if (nodes_.empty()) return;
    list_couplings(system);
    BlockPattern pattern(adjacency(system));
    if (analyzed_ && pattern == pattern_) return;
    pattern_ = std::move(pattern);
    A_ = pattern_.zero_matrix();
    analyzed_ = false;
    cholesky_.analyze(A_, ordering_);
    analyzed_ = true;
    rhs_.resize(3 * static_cast<Eigen::Index>(nodes_.size()));
}

void PatchFactor::factorize(const CoupledSystem& system, const std::vector<char>& inside) {
    if (!is_covered(system, inside)) analyze(system, inside);
    is_new_ = false;
    if (nodes_.empty()) return;
    fill(system);
    cholesky_.factorize(A_);
}

void PatchFactor::clear_product(const CoupledSystem& system, Eigen::VectorXd& v) {
    if (empty()) return;
    product_.resize(system.size());
    BodyOf body_of(system);
    for (const int i : nodes_) {
        const auto [body, node] = body_of(i);
        product_.segment<3>(3 * i) =
            system.systems[body].matrix().multiply_row(node, v.data() + system.first_unknown[body]);
    }
    system.add_couplings(v, product_);
    for (Eigen::Index s = 0; s < node_count(); ++s) {
        const int i = 3 * nodes_[static_cast<std::size_t>(s)];
        rhs_.segment<3>(3 * s) = -product_.segment<3>(i);
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
