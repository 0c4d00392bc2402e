#pragma once

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// A ball around the origin: an icosahedron whose faces are split into four `level` times, filled with
/// tetrahedra. poles > 1 crowds the vertices at both ends of the z axis. May be called by several threads.
TetMesh ball(double radius, int level, double poles = 1);

/// The surface of a box around the origin, of square cells.
TriMesh box_surface(const Eigen::Vector3d& size, const Eigen::Vector3i& cells);

/// Fills a surface as `nbdtree mesh` does by default. May be called by several threads.
TetMesh filled(const TriMesh& surface);

}  // namespace nbd
