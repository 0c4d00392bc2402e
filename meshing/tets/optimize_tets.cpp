#include "meshing/tets/optimize_tets.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "collision/base/stop.hpp"
#include "meshing/tets/tet_complex.hpp"

namespace nbd {
namespace {

// Changes of a neighbourhood, each the best of its kind by the least radius ratio that it leaves. A ratio
// <= 0 means that the change is not possible. The same input gives the same bits.

constexpr double infinity = std::numeric_limits<double>::infinity();

double least_ratio(const TetComplex& complex, const TetChange& change) {
    double least = infinity;
    for (const Tet& tet : change.added) least = std::min(least, complex.ratio(tet, &change));
    return least;
}

/// The best triangulation of a polygon by the worst of the two tetrahedra that each triangle makes with the
/// ends of the removed edge. Source: [Klincsek80].
class PolygonFill {
 public:
    PolygonFill(const TetComplex& complex, const std::vector<int>& nodes, int a, int b)
        : complex_(complex),
          nodes_(nodes),
          a_(a),
          b_(b),
          n_(nodes.size()),
          best_(n_ * n_, infinity),
          apex_(n_ * n_) {
        for (std::size_t width = 2; width < n_; ++width)
            for (std::size_t i = 0; i + width < n_; ++i) fill(i, i + width);
    }

    TetChange change(std::vector<int> removed) const {
        TetChange change;
        change.removed = std::move(removed);
        change.ratio = best_[n_ - 1];
        collect(0, n_ - 1, change.added);
        return change;
    }

 private:
    std::array<Tet, 2> pair(std::size_t i, std::size_t k, std::size_t j) const {
        return {Tet{nodes_[i], nodes_[k], nodes_[j], b_}, Tet{nodes_[i], nodes_[j], nodes_[k], a_}};
    }

    void fill(std::size_t i, std::size_t j) {
        double& best = best_[i * n_ + j] = -infinity;
        for (std::size_t k = i + 1; k < j; ++k) {
            const auto [upper, lower] = pair(i, k, j);
            const double ratio = std::min(
                {best_[i * n_ + k], best_[k * n_ + j], complex_.ratio(upper), complex_.ratio(lower)});
            if (ratio > best) best = ratio, apex_[i * n_ + j] = k;
        }
    }

    void collect(std::size_t i, std::size_t j, std::vector<Tet>& tets) const {
        if (j < i + 2) return;
        const std::size_t k = apex_[i * n_ + j];
        const auto [upper, lower] = pair(i, k, j);
        tets.push_back(upper);
        tets.push_back(lower);
        collect(i, k, tets);
        collect(k, j, tets);
    }

    const TetComplex& complex_;
    const std::vector<int>& nodes_;
    const int a_, b_;
    const std::size_t n_;
    std::vector<double> best_;  // of the polygon's part from i to j
    std::vector<std::size_t> apex_;
};

/// Compass search for the position of `change.node` that makes its worst tetrahedron best.
void find_best_position(const TetComplex& complex, TetChange& change) {
    constexpr int max_rounds = 60;
    double step = 0;
    for (const Tet& tet : change.added)
        for (const int node : tet)
            if (node != change.node) step = std::max(step, (complex.position(node) - change.position).norm());
    const double least_step = 1e-3 * step;
    change.ratio = least_ratio(complex, change);
    step *= 0.25;
    // A search that starts outside its tetrahedra may find no end.
    for (int round = 0; round < max_rounds && step > least_step; ++round) {
        const Eigen::RowVector3d centre = change.position;
        Eigen::RowVector3d position = centre;
        double ratio = change.ratio;
        for (int direction = 0; direction < 27; ++direction) {
            const Eigen::RowVector3i d(direction % 3 - 1, direction / 3 % 3 - 1, direction / 9 - 1);
            if (direction == 13) continue;  // no step
            change.position = centre + step * d.cast<double>().normalized();
            if (const double found = least_ratio(complex, change); found > ratio)
                ratio = found, position = change.position;
        }
        change.position = position;
        if (!(ratio > change.ratio)) step /= 2;
        change.ratio = ratio;
    }
}

bool contains(const std::vector<int>& cavity, int t) { return std::ranges::find(cavity, t) != cavity.end(); }

/// Fills a cavity with the tetrahedra that its faces make with a new node.
TetChange fill_cavity(const TetComplex& complex, std::vector<int> cavity, const Eigen::RowVector3d& start) {
    TetChange change;
    change.node = complex.nodes();
    change.position = start;
    for (const int t : cavity)
        for (int c = 0; c < 4; ++c) {
            if (contains(cavity, complex.neighbour(t, c))) continue;
            Tet tet = complex.tet(t);
            tet[c] = change.node;
            change.added.push_back(tet);
        }
    change.removed = std::move(cavity);
    find_best_position(complex, change);
    return change;
}

/// Tetrahedra outside that share a face with the cavity, sorted.
std::vector<int> neighbours(const TetComplex& complex, const std::vector<int>& cavity) {
    std::vector<int> found;
    for (const int t : cavity)
        for (int c = 0; c < 4; ++c) {
            const int other = complex.neighbour(t, c);
            if (other >= 0 && !contains(cavity, other)) found.push_back(other);
        }
    std::ranges::sort(found);
    found.erase(std::unique(found.begin(), found.end()), found.end());
    return found;
}

/// Whether all tetrahedra of some inner node are in the cavity, so that filling it would lose the node.
bool encloses_a_node(const TetComplex& complex, const std::vector<int>& cavity) {
    return std::ranges::any_of(cavity, [&](int t) {
        return std::ranges::any_of(complex.tet(t), [&](int node) {
            return !complex.on_boundary(node) && std::ranges::all_of(complex.star(node), [&](int other) {
                return contains(cavity, other);
            });
        });
    });
}

/// Removes the edge a-b of tetrahedron `t` and fills the polygon around it (3-2 flip, 4-4 flip and so on). An
/// edge of the boundary or with more than 12 tetrahedra cannot be removed: the result is empty.
/// Source: [FreitagOllivierGooch97].
std::optional<TetChange> remove_edge(const TetComplex& complex, int t, int a, int b) {
    constexpr std::size_t max_tets = 12;
    auto ring = complex.ring(t, a, b);
    if (!ring || ring->tets.size() > max_tets) return std::nullopt;
    return PolygonFill(complex, ring->nodes, a, b).change(std::move(ring->tets));
}

/// Replaces the face of `t` opposite to its corner `c` by an edge (2-3 flip). The result is empty for a
/// boundary face.
std::optional<TetChange> remove_face(const TetComplex& complex, int t, int c) {
    const int other = complex.neighbour(t, c);
    if (other < 0) return std::nullopt;
    const auto [d, f0, f1, f2] = complex.tet_from(t, c);
    int e = 0;
    for (const int node : complex.tet(other))
        if (node != f0 && node != f1 && node != f2) e = node;
    TetChange change;
    change.removed = {t, other};
    change.added = {Tet{d, e, f0, f1}, Tet{d, e, f1, f2}, Tet{d, e, f2, f0}};
    change.ratio = least_ratio(complex, change);
    return change;
}

/// Moves a node to where its worst tetrahedron is best. The result is empty for a node of the boundary.
std::optional<TetChange> move_node(const TetComplex& complex, int node) {
    if (complex.on_boundary(node)) return std::nullopt;
    TetChange change;
    change.removed = complex.star(node);
    for (const int t : change.removed) change.added.push_back(complex.tet(t));
    change.node = node;
    change.position = complex.position(node);
    find_best_position(complex, change);
    return change;
}

/// Puts a new node into the tetrahedra around the edge a-b of `t`, in place of the edge, and moves it to
/// where its worst tetrahedron is best. The result is empty for an edge of the boundary.
std::optional<TetChange> insert_node(const TetComplex& complex, int t, int a, int b) {
    const auto ring = complex.ring(t, a, b);
    if (!ring) return std::nullopt;
    return fill_cavity(complex, ring->tets, (complex.position(a) + complex.position(b)) / 2);
}

/// Lets the new node of such a change take the place of one more tetrahedron after the other, as long as its
/// worst tetrahedron gets better.
TetChange widen(const TetComplex& complex, TetChange change) {
    constexpr int max_steps = 12;
    for (int step = 0; step < max_steps; ++step) {
        std::optional<TetChange> best;
        for (const int next : neighbours(complex, change.removed)) {
            std::vector<int> cavity = change.removed;
            cavity.push_back(next);
            if (encloses_a_node(complex, cavity)) continue;
            TetChange wider = fill_cavity(complex, std::move(cavity), change.position);
            if (!best || wider.ratio > best->ratio) best = std::move(wider);
        }
        if (!best || !(best->ratio > change.ratio)) break;
        change = std::move(*best);
    }
    return change;
}

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
        next.erase(std::unique(next.begin(), next.end()), next.end());
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
