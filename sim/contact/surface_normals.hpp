#pragma once

#include <Eigen/Core>
#include <vector>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Which edges and faces meet where on a surface: fixed while the surface moves.
struct SurfaceTopology {
    using Pairs = Eigen::Matrix<int, Eigen::Dynamic, 2, Eigen::RowMajor>;
    Faces face_edges;               // [m, 3] the edge opposite corner 0, 1, 2
    Pairs edges;                    // [e, 2] vertices, smaller first; rows in lexicographic order
    Pairs edge_faces;               // [e, 2] adjacent faces; second -1: the surface is open there
    std::vector<int> vertex_begin;  // [n + 1] range of vertex_faces
    std::vector<int> vertex_faces;  // faces at each vertex, ascending

    /// Whether `face` is the one, of all that meet in its vertex or edge, that answers for it: a loop over
    /// faces meets each vertex and each edge once in this way.
    bool owns_vertex(int face, int vertex) const noexcept {
        return vertex_faces[static_cast<std::size_t>(vertex_begin[static_cast<std::size_t>(vertex)])] == face;
    }
    bool owns_edge(int face, int edge) const noexcept { return edge_faces(edge, 0) == face; }
};

/// Throws std::invalid_argument on an index outside 0 .. vertex_count - 1, or where an edge has more than
/// two faces.
SurfaceTopology surface_topology(FacesRef F, int vertex_count);

/// Area of each vertex: a third of its faces' areas, m2. [n].
Eigen::VectorXd vertex_areas(FacesRef F, NodesRef x);

/// Outward unit normal of a face; zero where it is degenerate.
Eigen::Vector3d face_normal(FacesRef F, NodesRef x, int face) noexcept;

/// Mean normal of the edge's faces, unit.
Eigen::Vector3d edge_normal(const SurfaceTopology& topology, FacesRef F, NodesRef x, int edge) noexcept;

/// The normal that tells inside from outside at the point of `face` with these barycentric coordinates: the
/// face's within it, the mean of two on an edge, the mean weighted by angles in a vertex. A coordinate that
/// is exactly 0 puts the point on the opposite edge. Source: [BaerentzenAanaes05].
Eigen::Vector3d feature_normal(const SurfaceTopology& topology, FacesRef F, NodesRef x, int face,
                               const Eigen::Vector3d& barycentric) noexcept;

}  // namespace nbd
