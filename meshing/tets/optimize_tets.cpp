#include "meshing/tets/optimize_tets.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "collision/base/stop.hpp"
#include "meshing/tets/local_changes.hpp"
#include "meshing/tets/tet_complex.hpp"
#include "meshing/tets/tet_quality.hpp"

namespace nbd {
namespace {

constexpr int edges[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};

void keep_better(std::optional<TetChange>& best, std::optional<TetChange> change) {
    if (change && (!best || change->ratio > best->ratio)) best = std::move(change);
}

std::optional<TetChange> best_change(const TetComplex& complex, int t) {
    const Tet& tet = complex.tet(t);
    std::optional<TetChange> best;
    for (const auto& [a, b] : edges) keep_better(best, remove_edge(complex, t, tet[a], tet[b]));
    for (int c = 0; c < 4; ++c) {
        keep_better(best, remove_face(complex, t, c));
        keep_better(best, move_node(complex, tet[c]));
    }
    return best;
}

std::optional<TetChange> best_insertion(const TetComplex& complex, int t) {
    const Tet& tet = complex.tet(t);
    std::optional<TetChange> best;
    for (const auto& [a, b] : edges) keep_better(best, insert_node(complex, t, tet[a], tet[b]));
    if (best && best->ratio < poor_radius_ratio) best = widen(complex, std::move(*best));
    return best;
}

/// The change to make for a poor tetrahedron, if there is one that helps.
std::optional<TetChange> remedy(const TetComplex& complex, int t, bool may_add) {
    constexpr double gain = 1.01;  // smaller gains are not worth another round
    const auto helps = [&](const std::optional<TetChange>& change) {
        return change && change->ratio > gain * complex.least_ratio(change->removed);
    };
    std::optional<TetChange> change = best_change(complex, t);
    if (!helps(change)) change.reset();
    if (may_add && (!change || change->ratio < poor_radius_ratio)) {
        std::optional<TetChange> insertion = best_insertion(complex, t);
        if (helps(insertion) && insertion->ratio >= poor_radius_ratio) return insertion;
    }
    return change;
}

}  // namespace

TetOptimization optimize_tets(TetMesh& tets, int max_new_nodes) {
    TetOptimization result;
    std::vector<int> poor;
    for (int t = 0; t < tets.T.rows(); ++t)
        if (radius_ratio(tets.X.row(tets.T(t, 0)), tets.X.row(tets.T(t, 1)), tets.X.row(tets.T(t, 2)),
                         tets.X.row(tets.T(t, 3))) < poor_radius_ratio)
            poor.push_back(t);
    result.poor_before = poor.size();
    if (poor.empty()) return result;

    TetComplex complex(tets);
    const auto is_poor = [&](int t) {
        return !complex.removed(t) && complex.ratio(complex.tet(t)) < poor_radius_ratio;
    };
    for (bool changed = true; changed;) {
        changed = false;
        std::vector<int> next = poor;
        for (const int t : poor) {
            if (!is_poor(t)) continue;
            stop_if_asked();
            const std::optional<TetChange> change = remedy(complex, t, result.nodes_added < max_new_nodes);
            if (!change) continue;
            result.nodes_added += change->node == complex.nodes();
            const std::vector<int> places = complex.apply(*change);
            next.insert(next.end(), places.begin(), places.end());
            changed = true;
        }
        std::ranges::sort(next);
        next.erase(std::ranges::unique(next).begin(), next.end());
        std::erase_if(next, [&](int t) { return !is_poor(t); });
        poor = std::move(next);
    }
    result.poor_after = poor.size();
    tets = complex.mesh();
    return result;
}

std::string describe(const TetOptimization& o) {
    return fmt::format("optimised {} of {} tetrahedra below a radius ratio of {}; added {} node{}",
                       o.poor_before - o.poor_after, o.poor_before, poor_radius_ratio, o.nodes_added,
                       o.nodes_added == 1 ? "" : "s");
}

}  // namespace nbd
