#pragma once

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// A sphere for pictures: `rows` rows of twice as many quads, split into triangles.
TriMesh ball_mesh(const Eigen::Vector3d& centre, double radius, int rows = 32);

}  // namespace nbd
