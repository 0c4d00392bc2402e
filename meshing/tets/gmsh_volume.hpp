#pragma once

#include <functional>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Desired edge length at a point, metres, > 0.
using SizeField = std::function<double(const Eigen::Vector3d&)>;

/// Fills a closed surface with tetrahedra by gmsh (Delaunay, one thread) and keeps its triangles: the nodes
/// start with surface.X bit for bit, the oriented boundary faces are exactly surface.F, every node belongs to
/// a tetrahedron and every tetrahedron has positive volume. The same input gives the same bits.
/// surface: closed, manifold, free of self-intersections, oriented outward: one shell, and any number of
/// cavities in it, whose faces look into them.
/// Only one call per process runs at a time, because gmsh is one global object. The call leaves no terminal
/// output, changed stack limit or callback behind. Throws std::runtime_error with gmsh's reason or with the
/// guarantee that its result violates.
TetMesh fill_with_gmsh(const TriMesh& surface, const SizeField& size);

}  // namespace nbd
