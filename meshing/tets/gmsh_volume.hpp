#pragma once

#include <functional>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Wanted edge length at a point, metres, > 0.
using SizeField = std::function<double(const Eigen::Vector3d&)>;

/// Fills a closed surface with tetrahedra by gmsh (Delaunay, one thread), keeping its triangles: the nodes
/// start with surface.X bit for bit, the oriented boundary faces are exactly surface.F, every node belongs to
/// a tetrahedron and every tetrahedron is positive. Same input, same bits.
/// surface: closed, manifold, free of self-intersections, oriented outward. Only one call runs at a time in a
/// process, since gmsh is one global object; nothing of it (terminal output, stack limit, callback) stays
/// behind. Throws std::runtime_error with gmsh's reason, or with the guarantee that its answer broke.
TetMesh fill_with_gmsh(const TriMesh& surface, const SizeField& size);

}  // namespace nbd
