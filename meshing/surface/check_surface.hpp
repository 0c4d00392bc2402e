#pragma once

#include <stdexcept>
#include <vector>

#include "meshing/surface/edges.hpp"
#include "meshing/surface/mesh.hpp"

namespace nbd {

/// An edge of the surface belongs to one face only, or to more than two.
struct SurfaceNotClosed : std::invalid_argument {
    using std::invalid_argument::invalid_argument;
};

/// Rejects a surface that does not bound a solid: no faces, an index out of range, a vertex that is not
/// finite or beyond 1e30 m, a face that repeats a vertex or has no area (its height is at most 1e-7 of its
/// longest side, so rounding), two faces with the same vertices, an open edge, an edge of more than two
/// faces, or a vertex where several fans of faces touch only at their tips. make_solid_boundary() checks
/// orientation, self-intersection and components. Returns the edges, each with two faces. Throws a one-line
/// std::invalid_argument (SurfaceNotClosed for an edge) that names the first such face, edge or vertex
/// (0-based) and their number.
EdgeTable check_surface(const TriMesh& mesh);

/// Pairs of faces of a surface that intersect beyond their shared vertices and edges, by exact tests on the
/// float32 positions. Faces that share an edge intersect if one is folded flat onto the other. Sorted, a < b.
/// mesh: closed, edge-manifold, consistently oriented, without degenerate faces (see check_surface()).
std::vector<FacePair> self_intersections(const TriMesh& mesh);

}  // namespace nbd
