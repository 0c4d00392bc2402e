#include "sim/obstacles/static_surface.hpp"

#include <cmath>
#include <stdexcept>
#include <utility>
#include <vector>

#include "collision/geometry/closest_points.hpp"

namespace nbd {
namespace {

ClosestPoints closest_point(const TriMesh& mesh, int face, const Eigen::Vector3d& p) noexcept {
    const auto corner = [&](int k) -> Eigen::Vector3d { return mesh.X.row(mesh.F(face, k)); };
    return closest_point_triangle(p, corner(0), corner(1), corner(2));
}

SurfaceTopology checked_topology(const TriMesh& mesh) {
    if (mesh.F.rows() == 0) throw std::invalid_argument("static surface: it has no faces");
    if (!mesh.X.allFinite()) throw std::invalid_argument("static surface: a vertex is not finite");
    return surface_topology(mesh.F, mesh.X.rows());
}

bool has_open_edge(const SurfaceTopology& topology) {
    for (Eigen::Index e = 0; e < topology.edges.rows(); ++e)
        if (topology.edge_faces(e, 1) < 0) return true;
    return false;
}

std::vector<BoxTree::Box> face_boxes(const TriMesh& mesh) {
    std::vector<BoxTree::Box> boxes(mesh.F.rows());
    for (Eigen::Index f = 0; f < mesh.F.rows(); ++f)
        for (const int vertex : mesh.F.row(f)) boxes[f].extend(mesh.X.row(vertex).transpose());
    return boxes;
}

}  // namespace

StaticSurface::StaticSurface(TriMesh mesh)
    : mesh_(std::move(mesh)),
      topology_(checked_topology(mesh_)),
      faces_(face_boxes(mesh_)),
      is_open_(has_open_edge(topology_)) {
    for (const int vertex : mesh_.F.reshaped()) box_.extend(mesh_.X.row(vertex).transpose());
}

std::optional<SurfaceDistance> StaticSurface::distance(const Eigen::Vector3d& p,
                                                       double reach) const noexcept {
    if (box_.exteriorDistance(p) > reach) return std::nullopt;
    const auto [face, squared] =
        faces_.nearest(p, [&](int f) { return closest_point(mesh_, f, p).gap.squaredNorm(); });
    const ClosestPoints nearest = closest_point(mesh_, face, p);
    // Of an open surface any normal serves, where a point lies on it.
    const Eigen::Vector3d where = is_open_ ? Eigen::Vector3d::Constant(1.0 / 3) : nearest.weights_b;
    const Eigen::Vector3d outward = feature_normal(topology_, mesh_.F, mesh_.X, face, where);
    const double distance = std::sqrt(squared), sign = !is_open_ && nearest.gap.dot(outward) < 0 ? -1 : 1;
    if (distance < 1e-12) return SurfaceDistance{.distance = 0, .normal = outward};
    return SurfaceDistance{.distance = sign * distance, .normal = sign * nearest.gap / distance};
}

}  // namespace nbd
