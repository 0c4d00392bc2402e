#pragma once

#include <span>

#include "collision/geometry/geometry.hpp"

namespace nbd {

/// The one bounding-sphere rule of the project: centre = mean of the listed vertices, radius = largest
/// distance from it. A vertex listed twice weighs twice. Linear in the positions up to the radius, so it
/// moves with rigid motion exactly and never jumps, which labels for a regression need; a minimal ball
/// would be smaller by a few percent and is not smooth.
/// x: all positions, [n, 3]. vertices: rows of x, not empty.
/// Returns a sphere that contains the listed vertices: the radius is rounded up by a few ulp.
Sphere bounding_sphere(VerticesRef x, std::span<const int> vertices) noexcept;

}  // namespace nbd
