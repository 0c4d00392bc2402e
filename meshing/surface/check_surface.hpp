#pragma once

#include "meshing/surface/edges.hpp"
#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Refuses a surface that does not bound a solid: one without faces, with an index out of range, a vertex
/// that is not finite, a face that repeats a vertex or has no area (its height is at most 1e-7 of its
/// longest side: nothing but rounding), two faces over the same vertices, an open edge, an edge of more than
/// two faces, or a vertex at which only the tips of several fans of faces meet. Orientation, self-
/// intersection and components are solid_boundary()'s matter.
/// Returns the edges, each with two faces.
/// Throws std::invalid_argument: one line that names the first such face, edge or vertex (0-based) and how
/// many there are.
EdgeTable check_surface(const TriMesh& mesh);

}  // namespace nbd
