#pragma once

#include <functional>
#include <vector>

#include "collision/geometry/tet_mesh.hpp"

namespace nbd::test {

/// A box [0, size] with cells x, y, z, each cut into six tetrahedra around its diagonal. Inner nodes are
/// displaced by up to `jitter` of a cell in a fixed pattern.
TetMesh box_mesh(const Eigen::Vector3d& size, const Eigen::Vector3i& cells, double jitter = 0);

/// Nodes at positions for which `test` is true.
std::vector<int> nodes_where(const Nodes& X, const std::function<bool(const Eigen::Vector3d&)>& test);

/// A smooth, large, deterministic field over the nodes, with entries of order `size`.
Nodes wild_field(const Nodes& X, double size);

/// Centre of a tetrahedron.
Eigen::RowVector3d centre(const TetMesh& tets, int tet);

}  // namespace nbd::test
