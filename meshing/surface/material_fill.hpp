#pragma once

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// The means of products z z^T of barycentric coordinates that a row of TetFill tells.
Eigen::Matrix4d coordinate_products(const Eigen::Matrix<double, 1, 10>& fill);
/// The row of TetFill that tells these means.
Eigen::Matrix<double, 1, 10> fill_of_products(const Eigen::Matrix4d& products);

/// How much of each tetrahedron lies within a surface, with a hundred thousandth of what does not, so that no
/// node is without mass and stiffness [Parvizian07]. Integrated along lines across the surface: exact there,
/// and by a hundred lines or more in each tetrahedron that the surface may cut. solid: closed, faces outward,
/// cavities into their hollow; may intersect itself. The same on any number of threads.
TetFill material_fill(const TetMesh& tets, const TriMesh& solid);

}  // namespace nbd
