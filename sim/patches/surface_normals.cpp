#include "sim/patches/surface_normals.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <stdexcept>

namespace nbd {
namespace {

/// Outward unit normal of a face; zero for a degenerate face.
Eigen::Vector3d face_normal(FacesRef F, NodesRef x, int face) noexcept {
    const Eigen::Vector3d u = x.row(F(face, 1)) - x.row(F(face, 0)),
                          w = x.row(F(face, 2)) - x.row(F(face, 0));
    return u.cross(w).stableNormalized();
}

/// Normalised mean of the normals of the edge's faces.
Eigen::Vector3d edge_normal(const SurfaceTopology& topology, FacesRef F, NodesRef x, int edge) noexcept {
    Eigen::Vector3d sum = face_normal(F, x, topology.edge_faces(edge, 0));
    if (const int other = topology.edge_faces(edge, 1); other >= 0) sum += face_normal(F, x, other);
    return sum.stableNormalized();
}

Eigen::Vector3d vertex_normal(const SurfaceTopology& topology, FacesRef F, NodesRef x, int vertex) noexcept {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    const std::size_t v = vertex;
    for (int i = topology.vertex_begin[v]; i < topology.vertex_begin[v + 1]; ++i) {
        const int f = topology.vertex_faces[i];
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
    SurfaceTopology topology{surface_features(F, vertex_count), {}};
    topology.edge_faces.setConstant(topology.edges.rows(), 2, -1);
    for (int f = 0; f < F.rows(); ++f)
        for (int k = 0; k < 3; ++k) {
            const int e = topology.face_edges(f, k);
            if (topology.edge_faces(e, 1) >= 0)
                throw std::invalid_argument(fmt::format("surface: edge {}-{} belongs to more than two faces",
                                                        topology.edges(e, 0), topology.edges(e, 1)));
            topology.edge_faces(e, topology.edge_faces(e, 0) < 0 ? 0 : 1) = f;
        }
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
