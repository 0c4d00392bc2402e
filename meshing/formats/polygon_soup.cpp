#include "meshing/formats/polygon_soup.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "meshing/polygons/triangulate_polygon.hpp"

namespace nbd {

TriMesh triangulate(const PolygonSoup& soup) {
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
    }
    if (triangles.empty()) throw std::runtime_error("no faces in the file");
    mesh.F.resize(triangles.size(), 3);
    for (std::size_t f = 0; f < triangles.size(); ++f)
        mesh.F.row(f) << triangles[f][0], triangles[f][1], triangles[f][2];
    return mesh;
}

}  // namespace nbd
