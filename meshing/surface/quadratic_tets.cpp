#include "meshing/surface/quadratic_tets.hpp"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <utility>
#include <vector>

namespace nbd {
namespace {

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

TetMesh make_quadratic(TetMesh mesh) {
    using Edge = std::pair<int, int>;
    const auto edge_of = [&](Eigen::Index tet, std::size_t k) -> Edge {
        return std::minmax({mesh.T(tet, edges_of_tet[k].first), mesh.T(tet, edges_of_tet[k].second)});
    };
    std::vector<Edge> edges;
    for (Eigen::Index t = 0; t < mesh.T.rows(); ++t)
        for (std::size_t k = 0; k < edges_of_tet.size(); ++k) edges.push_back(edge_of(t, k));
    std::ranges::sort(edges);
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());

    const Eigen::Index corners = mesh.X.rows();
    mesh.X.conservativeResize(corners + std::ssize(edges), Eigen::NoChange);
    for (std::size_t e = 0; e < edges.size(); ++e)
        mesh.X.row(corners + e) = 0.5 * (mesh.X.row(edges[e].first) + mesh.X.row(edges[e].second));
    mesh.E.resize(mesh.T.rows(), Eigen::NoChange);
    for (Eigen::Index t = 0; t < mesh.T.rows(); ++t)
        for (std::size_t k = 0; k < edges_of_tet.size(); ++k)
            mesh.E(t, k) = corners + (std::ranges::lower_bound(edges, edge_of(t, k)) - edges.begin());
    return mesh;
}

TetMesh as_elements(TetMesh mesh, std::optional<Elements> elements) {
    if (!elements || mesh.is_quadratic() == (*elements == Elements::quadratic)) return mesh;
    if (mesh.is_quadratic())
        throw std::invalid_argument("its tetrahedra are quadratic and cannot become linear");
    return make_quadratic(std::move(mesh));
}

Tets corner_tets(const TetMesh& mesh) {
    if (!mesh.is_quadratic()) return mesh.T;
    Tets result(4 * mesh.T.rows(), 4);
    for (Eigen::Index t = 0; t < mesh.T.rows(); ++t) {
        for (int a = 0; a < 4; ++a) result(4 * t + a, a) = mesh.T(t, a);
        for (std::size_t k = 0; k < edges_of_tet.size(); ++k) {
            const auto [a, b] = edges_of_tet[k];
            result(4 * t + a, b) = result(4 * t + b, a) = mesh.E(t, k);
        }
    }
    return result;
}

ElementNodes nodes_of_tets(const TetMesh& mesh) {
    ElementNodes nodes(mesh.T.rows(), mesh.is_quadratic() ? 10 : 4);
    nodes.leftCols<4>() = mesh.T;
    if (mesh.is_quadratic()) nodes.rightCols<6>() = mesh.E;
    return nodes;
}

TetMesh split(const TetMesh& mesh) {
    const ElementNodes all = nodes_of_tets(mesh);
    TetMesh result{mesh.X, Tets(8 * mesh.T.rows(), 4)};
    for (Eigen::Index t = 0; t < mesh.T.rows(); ++t) {
        const auto nodes = all.row(t);
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
