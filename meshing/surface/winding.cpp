#include "meshing/surface/winding.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include "meshing/surface/edges.hpp"

namespace nbd {
namespace {

bool is_closed(const Faces& F) {
    for (Eigen::Index f = 0; f < F.rows(); ++f)
        if (F(f, 0) == F(f, 1) || F(f, 1) == F(f, 2) || F(f, 2) == F(f, 0)) return false;
    const EdgeTable table = edge_table(F);
    return std::ranges::all_of(table.edges, [](const auto& edge) { return edge.end - edge.begin == 2; });
}

/// One vertex of each part of a surface.
std::vector<int> vertex_of_each_part(const TriMesh& mesh) {
    std::vector<int> parent(mesh.X.rows());
    std::iota(parent.begin(), parent.end(), 0);
    const auto root = [&](int v) {
        while (parent[v] != v) {
            int& up = parent[v];
            up = parent[up];
            v = up;
        }
        return v;
    };
    for (Eigen::Index f = 0; f < mesh.F.rows(); ++f)
        for (int c = 1; c < 3; ++c) parent[root(mesh.F(f, c))] = root(mesh.F(f, 0));
    std::vector<int> vertices;
    for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) vertices.push_back(root(mesh.F(f, 0)));
    std::ranges::sort(vertices);
    vertices.erase(std::ranges::unique(vertices).begin(), vertices.end());
    return vertices;
}

}  // namespace

double winding_number(const TriMesh& mesh, std::span<const int> faces, const Eigen::RowVector3d& point) {
    double angle = 0;
    for (const int f : faces) {
        const Eigen::RowVector3d a = mesh.X.row(mesh.F(f, 0)) - point, b = mesh.X.row(mesh.F(f, 1)) - point,
                                 c = mesh.X.row(mesh.F(f, 2)) - point;
        const double la = a.norm(), lb = b.norm(), lc = c.norm();
        angle +=
            2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
    }
    return angle / (4 * std::numbers::pi);
}

Containment containment(const TriMesh& inner, const TriMesh& outer) {
    if (!is_closed(outer.F)) return Containment::none;
    Eigen::AlignedBox3d box;
    for (Eigen::Index v = 0; v < outer.X.rows(); ++v) box.extend(outer.X.row(v).transpose());
    std::vector<int> faces(outer.F.rows());
    std::iota(faces.begin(), faces.end(), 0);
    const std::vector<int> vertices = vertex_of_each_part(inner);
    const auto inside = std::ranges::count_if(vertices, [&](int v) {
        return box.contains(inner.X.row(v).transpose()) &&
               std::abs(winding_number(outer, faces, inner.X.row(v))) > 0.5;
    });
    if (inside == 0) return Containment::none;
    return inside == std::ssize(vertices) ? Containment::whole : Containment::some_parts;
}

}  // namespace nbd
