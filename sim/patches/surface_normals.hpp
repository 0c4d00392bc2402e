#pragma once

#include <Eigen/Core>

#include "collision/continuous/surface_features.hpp"
#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Vertices, edges and faces of a surface and their adjacency. Does not change while the surface moves.
struct SurfaceTopology : SurfaceFeatures {
    Pairs edge_faces;  // [e, 2] adjacent faces, the owner first; the second is -1 at an open edge
};

/// Throws std::invalid_argument for an index outside 0 .. vertex_count - 1 or an edge of more than two faces.
SurfaceTopology surface_topology(FacesRef F, int vertex_count);

/// Area of each vertex: a third of the areas of its faces, m2. [n].
Eigen::VectorXd vertex_areas(FacesRef F, NodesRef x);

/// Normal that separates inside from outside at a point of `face`: the face normal in its interior, the mean
/// of two face normals on an edge, the angle-weighted mean at a vertex. A barycentric coordinate that is
/// exactly 0 puts the point on the opposite edge. Source: [BaerentzenAanaes05].
Eigen::Vector3d feature_normal(const SurfaceTopology& topology, FacesRef F, NodesRef x, int face,
                               const Eigen::Vector3d& barycentric) noexcept;

}  // namespace nbd
