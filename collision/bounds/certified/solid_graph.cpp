#include "collision/bounds/certified/solid_graph.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <utility>

#include "collision/base/message.hpp"
#include "collision/bounds/certified/path_forest.hpp"

namespace nbd {

SolidGraph::SolidGraph(const TetMesh& solid, const SurfaceWeights& W, FacesRef F, std::span<const int> of_tet)
    : tets_of_(static_cast<std::size_t>(solid.X.rows())),
      places_(static_cast<std::size_t>(W.rows())),
      X_(W.cast<double>() * solid.X) {
    for (int t = 0; t < solid.T.rows(); ++t)
        for (const int node : solid.T.row(t)) tets_of_[static_cast<std::size_t>(node)].push_back(t);
    link_nodes(solid, of_tet);
    const auto nodes = static_cast<int>(solid.X.rows());
    pack(nodes);  // these links suffice for the tails of vertices on several tetrahedra
    int points = nodes;
    PathForest forest(*this);
    std::vector<char> wanted(static_cast<std::size_t>(nodes), 0);
    for (int v = 0; v < W.rows(); ++v) {
        Place& place = places_[static_cast<std::size_t>(v)];
        place.point = points;
        place_vertex(v, solid, W, of_tet, forest, wanted);
        points += place.point == points;
    }
    for (Eigen::Index f = 0; f < F.rows(); ++f)
        for (int k = 0; k < 3; ++k) {
            const int u = F(f, k), v = F(f, (k + 1) % 3);
            const Place &a = place(u), &b = place(v);
            if (u > v || (a.point < nodes && b.point < nodes)) continue;
            const auto common = std::ranges::find_first_of(a.homes, b.homes);
            if (common != a.homes.end())
                join(a.point, b.point, (X_.row(u) - X_.row(v)).norm(),
                     of_tet[static_cast<std::size_t>(*common)]);
        }
    pack(points);
}

void SolidGraph::join(int a, int b, double length, int region) {
    pairs_.push_back({a, b, {b, region, length}});
    pairs_.push_back({b, a, {a, region, length}});
}

/// Links the nodes along the edges of the tetrahedra.
void SolidGraph::link_nodes(const TetMesh& solid, std::span<const int> of_tet) {
    const auto length = [&](int a, int b) { return (solid.X.row(a) - solid.X.row(b)).norm(); };
    std::set<std::pair<int, int>> edges;
    for (int t = 0; t < solid.T.rows(); ++t)
        for (int a = 0; a < 4; ++a)
            for (int b = a + 1; b < 4; ++b) {
                const auto [low, high] = std::minmax(solid.T(t, a), solid.T(t, b));
                if (edges.emplace(low, high).second)
                    join(low, high, length(low, high), of_tet[static_cast<std::size_t>(t)]);
            }
}

void SolidGraph::place_vertex(int v, const TetMesh& solid, const SurfaceWeights& W,
                              std::span<const int> of_tet, PathForest& forest, std::vector<char>& wanted) {
    std::vector<int> nodes;
    std::vector<double> weights;
    for (SurfaceWeights::InnerIterator w(W, v); w; ++w)
        if (w.value() != 0) {
            nodes.push_back(static_cast<int>(w.col()));
            weights.push_back(static_cast<double>(w.value()));
        }
    if (nodes.empty())
        throw std::invalid_argument(message("surface vertex ", v, " depends on no node of the solid"));
    Place& place = places_[static_cast<std::size_t>(v)];
    const auto holds_all = [&](int t) {
        return std::ranges::all_of(nodes, [&](int n) { return (solid.T.row(t).array() == n).any(); });
    };
    std::ranges::copy_if(tets_of_[static_cast<std::size_t>(nodes.front())], std::back_inserter(place.homes),
                         holds_all);
    if (nodes.size() == 1) {
        place.point = nodes.front();
        return;
    }
    if (place.homes.empty()) return hang(place, nodes, weights, forest, wanted);
    std::set<int> corners;
    for (const int t : place.homes)
        for (const int n : solid.T.row(t))
            if (corners.insert(n).second) {
                const double length = (X_.row(v) - solid.X.row(n)).norm();
                join(place.point, n, length, of_tet[static_cast<std::size_t>(t)]);
                if (std::ranges::find(nodes, n) != nodes.end()) reach_ = std::max(reach_, length);
            }
    if (std::ranges::any_of(weights, [](double w) { return w < -1e-6; }))
        place.homes.clear();  // v is outside
}

/// Attaches a vertex to its node with most weight, by shortest paths from there to its other nodes.
void SolidGraph::hang(Place& place, std::span<const int> nodes, std::span<const double> weights,
                      PathForest& forest, std::vector<char>& wanted) {
    const auto heaviest = std::ranges::max_element(weights, {}, [](double w) { return std::abs(w); });
    place.point = nodes[static_cast<std::size_t>(heaviest - weights.begin())];
    for (const int n : nodes) wanted[static_cast<std::size_t>(n)] = 1;
    forest.clear();
    forest.grow(place.point, PathForest::unreached, wanted, static_cast<int>(nodes.size()));
    std::set<int> regions;
    double farthest = 0;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        wanted[static_cast<std::size_t>(nodes[i])] = 0;
        const double length = forest.distance(nodes[i]);
        if (length == PathForest::unreached)
            throw std::invalid_argument(message("a surface vertex depends on nodes ", place.point, " and ",
                                                nodes[i], " of the solid, which no tetrahedra connect"));
        place.tail += std::abs(weights[i]) * length;
        farthest = std::max(farthest, length);
        forest.walk(nodes[i], [&](const Link& link) { regions.insert(link.region); });
    }
    reach_ = std::max(reach_, place.tail + farthest);
    place.regions.assign(regions.begin(), regions.end());
}

/// Groups the links by point.
void SolidGraph::pack(int points) {
    begin_.assign(static_cast<std::size_t>(points) + 1, 0);
    for (const Pair& pair : pairs_) ++begin_[static_cast<std::size_t>(pair.a) + 1];
    for (std::size_t i = 1; i < begin_.size(); ++i) begin_[i] += begin_[i - 1];
    links_.resize(pairs_.size());
    std::vector<int> next = begin_;
    for (const Pair& pair : pairs_)
        links_[static_cast<std::size_t>(next[static_cast<std::size_t>(pair.a)]++)] = pair.link;
}

}  // namespace nbd
