#pragma once

#include <Eigen/Core>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Closed surfaces about the origin, with faces that look outward. Lengths in metres, > 0. Surfaces that turn
/// about the z axis have `segments` sides, >= 3, with their corners on the round surface: a side's middle
/// lies within it by the radius times 1 - cos(pi / segments).
TriMesh box_mesh(const Eigen::Vector3d& size);
TriMesh cylinder_mesh(double radius, double length, int segments);
/// length: of the straight part between the half balls, >= 0.
TriMesh capsule_mesh(double radius, double length, int segments);

/// An open surface over a grid: heights(i, j) is z at x = j spacing.x(), y = i spacing.y(). Each rectangle is
/// cut along the diagonal from its corner with the smallest x and y. It looks upward. At least 2 x 2 heights.
TriMesh height_mesh(const Eigen::MatrixXd& heights, const Eigen::Vector2d& spacing);

}  // namespace nbd
