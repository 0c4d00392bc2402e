#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "collision/geometry/geometry.hpp"
#include "collision/geometry/tet_mesh.hpp"

namespace nbd {

/// Distance between neighbouring float32 numbers near `x`.
double float_step(double x) noexcept;

/// Mean length of the edges of faces, each face's three counted; 0 without faces. Leaves out faces that
/// name no row of X.
double mean_edge(NodesRef X, FacesRef F);

/// The origin from which float32 positions in `box` are counted. Zero while a step of float32 at the farthest
/// of them is below 1/4000 of `edge`, a length of the shape; else a point near the middle of the box. Its
/// coordinates are whole multiples of a power of two, so that what it is subtracted from and added to again
/// keeps its bits. box: finite; zero for an empty one.
Eigen::Vector3d far_origin(const Eigen::AlignedBox3d& box, double edge);

/// far_origin() of a surface, with its mean edge.
Eigen::Vector3d far_origin(NodesRef X, FacesRef F);

}  // namespace nbd
