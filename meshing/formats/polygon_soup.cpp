#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_face_base_with_info_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <limits>
#include <map>
#include <stdexcept>
#include <utility>
#include <vector>

#include "meshing/formats/surface_formats.hpp"

namespace nbd {
namespace {

using Triangles = std::vector<std::array<int, 3>>;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Vertex = CGAL::Triangulation_vertex_base_with_info_2<int, Kernel>;  // row of X
using Face = CGAL::Triangulation_face_base_with_info_2<int, Kernel,       // sides between it and the outside
                                                       CGAL::Constrained_triangulation_face_base_2<Kernel>>;
using Cdt =
    CGAL::Constrained_Delaunay_triangulation_2<Kernel, CGAL::Triangulation_data_structure_2<Vertex, Face>,
                                               CGAL::No_constraint_intersection_requiring_constructions_tag>;

struct Corner {
    int vertex;
    Eigen::Vector2d p;
};

/// The corners in the plane of the mean normal, which looks at the viewer.
std::vector<Corner> in_plane(NodesRef X, std::span<const int> corners) {
    const Eigen::Vector3d origin = X.row(corners[0]);
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    for (std::size_t i = 1; i + 1 < corners.size(); ++i)
        normal += (X.row(corners[i]).transpose() - origin).cross(X.row(corners[i + 1]).transpose() - origin);
    const Eigen::Vector3d u = normal.unitOrthogonal(), v = normal.normalized().cross(u);
    std::vector<Corner> ring;
    for (const int c : corners) {
        const Eigen::Vector3d d = X.row(c).transpose() - origin;
        ring.push_back({c, {d.dot(u), d.dot(v)}});
    }
    return ring;
}

Triangles fan(std::span<const int> corners) {
    Triangles triangles;
    for (std::size_t i = 1; i + 1 < corners.size(); ++i)
        triangles.push_back({corners[0], corners[i], corners[i + 1]});
    return triangles;
}

double turn(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
    return (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
}

/// Cuts along the diagonal that lies in the quadrilateral; most surfaces of other programs consist of these.
Triangles cut_quadrilateral(const std::vector<Corner>& q) {
    const int a = q[0].vertex, b = q[1].vertex, c = q[2].vertex, d = q[3].vertex;
    if (turn(q[3].p, q[0].p, q[1].p) > 0 && turn(q[1].p, q[2].p, q[3].p) > 0) return {{d, a, b}, {b, c, d}};
    return {{a, b, c}, {a, c, d}};
}

/// Writes to each face how many sides lie between it and the outside, region by region.
void measure_depth(Cdt& cdt) {
    for (const auto face : cdt.all_face_handles()) face->info() = -1;
    std::deque<std::pair<Cdt::Face_handle, int>> regions{
        {cdt.infinite_face(), 0}};  // a face of each, its depth
    std::vector<Cdt::Face_handle> region;
    for (; !regions.empty(); regions.pop_front()) {
        const auto [first, depth] = regions.front();
        if (first->info() >= 0) continue;
        first->info() = depth;
        region.assign(1, first);
        while (!region.empty()) {
            const Cdt::Face_handle face = region.back();
            region.pop_back();
            for (int side = 0; side < 3; ++side) {
                const Cdt::Face_handle other = face->neighbor(side);
                if (other->info() >= 0) continue;
                if (face->is_constrained(side)) {
                    regions.emplace_back(other, depth + 1);
                } else {
                    other->info() = depth;
                    region.push_back(other);
                }
            }
        }
    }
}

/// Empty where sides cross, corners coincide, or all lie on a line.
Triangles cut(const std::vector<Corner>& ring) {
    std::map<int, Cdt::Vertex_handle> handles;
    std::vector<std::pair<Kernel::Point_2, int>> points;
    for (const Corner& corner : ring) {
        if (!corner.p.allFinite()) return {};  // all corners on a line, or too far apart
        if (handles.emplace(corner.vertex, Cdt::Vertex_handle()).second)
            points.emplace_back(Kernel::Point_2(corner.p.x(), corner.p.y()), corner.vertex);
    }
    Cdt cdt;
    cdt.insert(points.begin(), points.end());
    if (cdt.number_of_vertices() != points.size() || cdt.dimension() < 2) return {};
    for (const auto vertex : cdt.finite_vertex_handles()) handles[vertex->info()] = vertex;
    try {
        for (std::size_t i = 0; i < ring.size(); ++i) {
            const int a = ring[i].vertex, b = ring[(i + 1) % ring.size()].vertex;
            if (a != b) cdt.insert_constraint(handles[a], handles[b]);
        }
    } catch (const Cdt::Intersection_of_constraints_exception&) {
        return {};
    }
    measure_depth(cdt);
    Triangles triangles;
    for (const auto face : cdt.finite_face_handles()) {
        if (face->info() % 2 == 0) continue;
        std::array<int, 3> t{face->vertex(0)->info(), face->vertex(1)->info(), face->vertex(2)->info()};
        std::rotate(t.begin(), std::ranges::min_element(t), t.end());
        triangles.push_back(t);
    }
    if (triangles.size() + 2 != ring.size()) return {};
    std::ranges::sort(triangles);
    return triangles;
}

}  // namespace

Triangles triangulate_polygon(NodesRef X, std::span<const int> corners) {
    if (corners.size() == 3) return fan(corners);
    const std::vector<Corner> ring = in_plane(X, corners);
    if (corners.size() == 4) return cut_quadrilateral(ring);
    Triangles triangles = cut(ring);
    return triangles.empty() ? fan(corners) : triangles;
}

TriMesh triangulate(const PolygonSoup& soup, std::vector<int>* face_of) {
    constexpr std::size_t most = std::numeric_limits<int>::max();
    if (soup.X.size() > most || soup.corners.size() > most)
        throw std::runtime_error(
            fmt::format("{} vertices and {} face corners, but at most {} can be numbered", soup.X.size(),
                        soup.corners.size(), most));
    constexpr double farthest = std::numeric_limits<float>::max();
    TriMesh mesh;
    mesh.X.resize(soup.X.size(), 3);
    for (std::size_t v = 0; v < soup.X.size(); ++v) {
        const auto& [x, y, z] = soup.X[v];
        if (!std::isfinite(x) || !std::isfinite(y) || !std::isfinite(z))
            throw std::runtime_error(fmt::format("vertex {} is not finite: ({}, {}, {})", v, x, y, z));
        if (std::max({std::abs(x), std::abs(y), std::abs(z)}) > farthest)
            throw std::runtime_error(fmt::format(
                "vertex {} is too far away: ({}, {}, {}); allowed: up to {:.3g} m", v, x, y, z, farthest));
        mesh.X.row(v) << x, y, z;
    }
    std::vector<std::array<int, 3>> triangles;
    std::vector<int> polygon;
    std::size_t begin = 0;
    for (std::size_t f = 0; f < soup.face_count(); ++f) {
        polygon.clear();
        for (; begin < soup.face_end[f]; ++begin) {
            const std::int64_t v = soup.corners[begin];
            if (v < 0 || v >= mesh.X.rows())
                throw std::runtime_error(fmt::format(
                    "face {} refers to vertex {}, but the file has {} vertices", f, v, soup.X.size()));
            polygon.push_back(v);
        }
        if (polygon.size() < 3) continue;
        for (const auto& triangle : triangulate_polygon(mesh.X, polygon)) triangles.push_back(triangle);
        if (face_of) face_of->resize(triangles.size(), static_cast<int>(f));
    }
    if (triangles.empty()) throw std::runtime_error("no faces in the file");
    mesh.F.resize(triangles.size(), 3);
    for (std::size_t f = 0; f < triangles.size(); ++f)
        mesh.F.row(f) << triangles[f][0], triangles[f][1], triangles[f][2];
    return mesh;
}

}  // namespace nbd
