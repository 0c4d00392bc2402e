#include "meshing/surface/shells.hpp"

#include <Eigen/Geometry>
#include <algorithm>

#include "meshing/surface/edges.hpp"

namespace nbd {
namespace {

double signed_volume(NodesRef X, FacesRef F, const std::vector<int>& faces) {
    const Eigen::RowVector3d origin = X.row(F(faces.front(), 0));  // near the faces, to limit cancellation
    double volume = 0;
    for (const int f : faces) {
        const Eigen::RowVector3d a = X.row(F(f, 0)) - origin, b = X.row(F(f, 1)) - origin,
                                 c = X.row(F(f, 2)) - origin;
        volume += a.dot(b.cross(c)) / 6;
    }
    return volume;
}

}  // namespace

std::vector<Shell> shells_of(NodesRef X, FacesRef F) {
    const int count = static_cast<int>(F.rows());
    const EdgeTable table = edge_table(F);
    DisjointSets parts(count);
    for (const EdgeTable::Edge& edge : table.edges)
        for (const int halfedge : table.at(edge)) parts.join(halfedge / 3, table.halfedges[edge.begin] / 3);
    std::vector<char> is_open(count, 0);  // by root
    for (const EdgeTable::Edge& edge : table.edges)
        if (edge.end - edge.begin != 2) is_open[parts.root(table.halfedges[edge.begin] / 3)] = 1;
    std::vector<Shell> shells;
    std::vector<int> number(count, -1);  // by root
    for (int f = 0; f < count; ++f) {
        const int root = parts.root(f);
        if (is_open[root]) continue;
        if (number[root] < 0) {
            number[root] = static_cast<int>(shells.size());
            shells.emplace_back();
        }
        shells[number[root]].faces.push_back(f);
    }
    for (Shell& shell : shells) shell.volume = signed_volume(X, F, shell.faces);
    return shells;
}

std::vector<Shell> cavities_of(NodesRef X, FacesRef F) {
    for (Eigen::Index f = 0; f < F.rows(); ++f)
        if (F(f, 0) == F(f, 1) || F(f, 1) == F(f, 2) || F(f, 2) == F(f, 0)) return {};
    std::vector<Shell> shells = shells_of(X, F);
    const auto is_outer = [](const Shell& shell) { return shell.volume > 0; };
    if (std::ranges::none_of(shells, is_outer)) return {};
    std::erase_if(shells, [](const Shell& shell) { return !(shell.volume < 0); });
    return shells;
}

TriMesh part_of(NodesRef X, FacesRef F, const std::vector<int>& faces, std::vector<int>* vertices) {
    std::vector<int> row(X.rows(), -1), rows;
    for (const int f : faces)
        for (const int v : F.row(f)) row[v] = 0;
    for (int v = 0; v < X.rows(); ++v)
        if (row[v] == 0) {
            row[v] = static_cast<int>(rows.size());
            rows.push_back(v);
        }
    TriMesh part{X(rows, Eigen::all), Faces(faces.size(), 3)};
    for (std::size_t f = 0; f < faces.size(); ++f)
        for (int c = 0; c < 3; ++c) part.F(f, c) = row[F(faces[f], c)];
    if (vertices) *vertices = std::move(rows);
    return part;
}

}  // namespace nbd
