#include "meshing/formats/polygon_soup.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <stdexcept>
#include <vector>

namespace nbd {
namespace {

double turn(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
    return (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
}

bool holds(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c,
           const Eigen::Vector2d& p) {
    return turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0;
}

/// Cuts a polygon into corners.size() - 2 triangles on its own corners, with its orientation, by ear clipping
/// in the plane of its mean normal. A polygon that is not simple in that plane gives overlapping triangles.
/// corners: three or more rows of X.
std::vector<std::array<int, 3>> triangulate_polygon(NodesRef X, std::span<const int> corners) {
    std::vector<std::array<int, 3>> triangles;
    if (corners.size() == 3) return {{corners[0], corners[1], corners[2]}};
    const Eigen::Vector3d origin = X.row(corners[0]);
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    for (std::size_t i = 1; i + 1 < corners.size(); ++i)
        normal += (X.row(corners[i]).transpose() - origin).cross(X.row(corners[i + 1]).transpose() - origin);
    const Eigen::Vector3d u = normal.unitOrthogonal(), v = normal.normalized().cross(u);

    struct Corner {
        int vertex;
        Eigen::Vector2d p;
    };
    std::vector<Corner> ring;
    for (const int c : corners) {
        const Eigen::Vector3d d = X.row(c).transpose() - origin;
        ring.push_back({c, {d.dot(u), d.dot(v)}});
    }
    while (ring.size() > 3) {
        const std::size_t n = ring.size();
        const auto is_ear = [&](std::size_t i) {
            const Corner &a = ring[(i + n - 1) % n], &b = ring[i], &c = ring[(i + 1) % n];
            if (turn(a.p, b.p, c.p) <= 0) return false;
            for (const Corner& other : ring)
                if (other.vertex != a.vertex && other.vertex != b.vertex && other.vertex != c.vertex &&
                    holds(a.p, b.p, c.p, other.p))
                    return false;
            return true;
        };
        std::size_t ear = 0;
        while (ear < n && !is_ear(ear)) ++ear;
        if (ear == n) ear = 1;  // not simple: any cut will do; 1 makes a fan around the first corner
        triangles.push_back({ring[(ear + n - 1) % n].vertex, ring[ear].vertex, ring[(ear + 1) % n].vertex});
        ring.erase(ring.begin() + static_cast<std::ptrdiff_t>(ear));
    }
    triangles.push_back({ring[0].vertex, ring[1].vertex, ring[2].vertex});
    return triangles;
}

}  // namespace

TriMesh triangulate(const PolygonSoup& soup) {
    constexpr auto most = static_cast<std::size_t>(std::numeric_limits<int>::max());
    if (soup.X.size() > most || soup.corners.size() > most)
        throw std::runtime_error(
            fmt::format("{} vertices and {} face corners, but at most {} can be numbered", soup.X.size(),
                        soup.corners.size(), most));
    TriMesh mesh;
    mesh.X.resize(static_cast<Eigen::Index>(soup.X.size()), 3);
    for (std::size_t v = 0; v < soup.X.size(); ++v) {
        const auto& [x, y, z] = soup.X[v];
        if (!std::isfinite(x) || !std::isfinite(y) || !std::isfinite(z))
            throw std::runtime_error(fmt::format("vertex {} is not finite: ({}, {}, {})", v, x, y, z));
        mesh.X.row(static_cast<Eigen::Index>(v)) << x, y, z;
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
            polygon.push_back(static_cast<int>(v));
        }
        if (polygon.size() < 3) continue;
        for (const auto& triangle : triangulate_polygon(mesh.X, polygon)) triangles.push_back(triangle);
    }
    if (triangles.empty()) throw std::runtime_error("no faces in the file");
    mesh.F.resize(static_cast<Eigen::Index>(triangles.size()), 3);
    for (std::size_t f = 0; f < triangles.size(); ++f)
        mesh.F.row(static_cast<Eigen::Index>(f)) << triangles[f][0], triangles[f][1], triangles[f][2];
    return mesh;
}

}  // namespace nbd
