#include "sim/patches/surface_normals.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace nbd {
namespace {

void list_edges(FacesRef F, SurfaceTopology& topology) {
    struct Side {
        int low, high, face, corner;
    };
    std::vector<Side> sides;
    sides.reserve(static_cast<std::size_t>(3 * F.rows()));
    for (int f = 0; f < F.rows(); ++f)
        for (int k = 0; k < 3; ++k) {
            const int i = F(f, (k + 1) % 3), j = F(f, (k + 2) % 3);
            sides.push_back({std::min(i, j), std::max(i, j), f, k});
        }
    std::ranges::sort(sides, {}, [](const Side& s) { return std::array{s.low, s.high, s.face}; });
    topology.face_edges.resize(F.rows(), 3);
    topology.edges.resize(static_cast<Eigen::Index>(sides.size()), 2);
    topology.edge_faces.setConstant(static_cast<Eigen::Index>(sides.size()), 2, -1);
    int edge = -1, users = 0;
    for (std::size_t i = 0; i < sides.size(); ++i) {
        const Side& s = sides[i];
        const bool fresh = i == 0 || sides[i - 1].low != s.low || sides[i - 1].high != s.high;
        users = fresh ? 0 : users + 1;
        if (fresh) topology.edges.row(++edge) << s.low, s.high;
        if (users > 1)
            throw std::invalid_argument(
                fmt::format("surface: edge {}-{} belongs to more than two faces", s.low, s.high));
        topology.edge_faces(edge, users) = s.face;
        topology.face_edges(s.face, s.corner) = edge;
    }
    topology.edges.conservativeResize(edge + 1, 2);
    topology.edge_faces.conservativeResize(edge + 1, 2);
}

void list_vertex_faces(FacesRef F, int vertex_count, SurfaceTopology& topology) {
    std::vector<int>& begin = topology.vertex_begin;
    begin.assign(static_cast<std::size_t>(vertex_count) + 1, 0);
    const auto corners = F.reshaped<Eigen::RowMajor>();
    for (const int v : corners) ++begin[static_cast<std::size_t>(v) + 1];
    for (std::size_t v = 1; v < begin.size(); ++v) begin[v] += begin[v - 1];
    topology.vertex_faces.resize(static_cast<std::size_t>(F.size()));
    std::vector<int> next(begin.begin(), begin.end() - 1);
    for (int f = 0; f < F.rows(); ++f)
        for (int k = 0; k < 3; ++k) {
            int& slot = next[static_cast<std::size_t>(F(f, k))];
            topology.vertex_faces[static_cast<std::size_t>(slot++)] = f;
        }
}

Eigen::Vector3d vertex_normal(const SurfaceTopology& topology, FacesRef F, NodesRef x, int vertex) noexcept {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    const auto v = static_cast<std::size_t>(vertex);
    for (int i = topology.vertex_begin[v]; i < topology.vertex_begin[v + 1]; ++i) {
        const int f = topology.vertex_faces[static_cast<std::size_t>(i)];
        const int k = F(f, 0) == vertex ? 0 : F(f, 1) == vertex ? 1 : 2;
        const Eigen::Vector3d to_next = x.row(F(f, (k + 1) % 3)) - x.row(vertex);
        const Eigen::Vector3d to_last = x.row(F(f, (k + 2) % 3)) - x.row(vertex);
        const Eigen::Vector3d cross = to_next.cross(to_last);
        sum += std::atan2(cross.norm(), to_next.dot(to_last)) * cross.stableNormalized();
    }
    return sum.stableNormalized();
}

}  // namespace

SurfaceTopology surface_topology(FacesRef F, int vertex_count) {
    for (Eigen::Index f = 0; f < F.rows(); ++f)
        for (int k = 0; k < 3; ++k)
            if (F(f, k) < 0 || F(f, k) >= vertex_count)
                throw std::invalid_argument(fmt::format(
                    "surface: face {} refers to vertex {}, but there are {}", f, F(f, k), vertex_count));
    SurfaceTopology topology;
    list_edges(F, topology);
    list_vertex_faces(F, vertex_count, topology);
    return topology;
}

Eigen::VectorXd vertex_areas(FacesRef F, NodesRef x) {
    Eigen::VectorXd areas = Eigen::VectorXd::Zero(x.rows());
    for (Eigen::Index f = 0; f < F.rows(); ++f) {
        const Eigen::Vector3d u = x.row(F(f, 1)) - x.row(F(f, 0)), w = x.row(F(f, 2)) - x.row(F(f, 0));
        for (int k = 0; k < 3; ++k) areas[F(f, k)] += u.cross(w).norm() / 6;
    }
    return areas;
}

Eigen::Vector3d face_normal(FacesRef F, NodesRef x, int face) noexcept {
    const Eigen::Vector3d u = x.row(F(face, 1)) - x.row(F(face, 0)),
                          w = x.row(F(face, 2)) - x.row(F(face, 0));
    return u.cross(w).stableNormalized();
}

Eigen::Vector3d edge_normal(const SurfaceTopology& topology, FacesRef F, NodesRef x, int edge) noexcept {
    Eigen::Vector3d sum = face_normal(F, x, topology.edge_faces(edge, 0));
    if (const int other = topology.edge_faces(edge, 1); other >= 0) sum += face_normal(F, x, other);
    return sum.stableNormalized();
}

Eigen::Vector3d feature_normal(const SurfaceTopology& topology, FacesRef F, NodesRef x, int face,
                               const Eigen::Vector3d& barycentric) noexcept {
    int corner = 0;
    switch ((barycentric.array() == 0).count()) {
        case 0:
            return face_normal(F, x, face);
        case 1:
            barycentric.minCoeff(&corner);
            return edge_normal(topology, F, x, topology.face_edges(face, corner));
        default:
            barycentric.maxCoeff(&corner);
            return vertex_normal(topology, F, x, F(face, corner));
    }
}

}  // namespace nbd
