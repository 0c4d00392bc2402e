#include "apps/bench/elements/quadratic_mesh.hpp"

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

namespace nbd {
namespace {

using Edge = std::pair<int, int>;

constexpr std::array<Edge, 6> edges_of_tet{{{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}};

Edge edge_between(const TetMesh& mesh, Eigen::Index tet, const Edge& local) {
    return std::minmax({mesh.T(tet, local.first), mesh.T(tet, local.second)});
}

/// Local nodes of the tetrahedra that keep a corner.
constexpr std::array<std::array<int, 4>, 4> corner_children{
    {{0, 4, 5, 6}, {4, 1, 7, 8}, {5, 7, 2, 9}, {6, 8, 9, 3}}};

/// A diagonal of the octahedron, and its other nodes in a circle around it such that diagonal, node and next
/// node are positively oriented.
struct Diagonal {
    int from, to;
    std::array<int, 4> around;
};
constexpr std::array<Diagonal, 3> diagonals{
    {{4, 9, {6, 8, 7, 5}}, {5, 8, {4, 7, 9, 6}}, {6, 7, {5, 9, 8, 4}}}};

}  // namespace

QuadraticMesh add_midpoints(const TetMesh& mesh) {
    std::vector<Edge> edges;
    for (Eigen::Index t = 0; t < mesh.T.rows(); ++t)
        for (const Edge& local : edges_of_tet) edges.push_back(edge_between(mesh, t, local));
    std::ranges::sort(edges);
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());

    const Eigen::Index corners = mesh.X.rows();
    QuadraticMesh result{Nodes(corners + edges.size(), 3), Elements<10>(mesh.T.rows(), 10)};
    result.X.topRows(corners) = mesh.X;
    for (std::size_t e = 0; e < edges.size(); ++e)
        result.X.row(corners + e) = 0.5 * (mesh.X.row(edges[e].first) + mesh.X.row(edges[e].second));
    result.T.leftCols<4>() = mesh.T;
    for (Eigen::Index t = 0; t < mesh.T.rows(); ++t)
        for (int k = 0; k < 6; ++k) {
            const auto at = std::ranges::lower_bound(edges, edge_between(mesh, t, edges_of_tet[k]));
            result.T(t, 4 + k) = corners + (at - edges.begin());
        }
    return result;
}

TetMesh split(const QuadraticMesh& mesh) {
    TetMesh result{mesh.X, Tets(8 * mesh.T.rows(), 4)};
    for (Eigen::Index t = 0; t < mesh.T.rows(); ++t) {
        const auto nodes = mesh.T.row(t);
        Eigen::Index child = 8 * t;
        for (const auto& [a, b, c, d] : corner_children)
            result.T.row(child++) << nodes[a], nodes[b], nodes[c], nodes[d];
        const auto length = [&](const Diagonal& diagonal) {
            return (mesh.X.row(nodes[diagonal.from]) - mesh.X.row(nodes[diagonal.to])).norm();
        };
        const Diagonal& cut = *std::ranges::min_element(diagonals, {}, length);
        for (std::size_t k = 0; k < 4; ++k)
            result.T.row(child++) << nodes[cut.from], nodes[cut.to], nodes[cut.around[k]],
                nodes[cut.around[(k + 1) % 4]];
    }
    return result;
}

}  // namespace nbd
