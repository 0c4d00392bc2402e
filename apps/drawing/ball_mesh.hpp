#pragma once

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Sphere mesh for pictures: `rows` rows of 2 * rows quads, split into triangles.
TriMesh ball_mesh(const Eigen::Vector3d& centre, double radius, int rows = 32);

}  // namespace nbd
