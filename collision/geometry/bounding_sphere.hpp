#pragma once

#include <span>

#include "collision/geometry/geometry.hpp"

namespace nbd {

/// The project's only bounding-sphere rule: centre = mean of the listed vertices, radius = largest distance
/// from it. A vertex listed twice counts twice. The centre is linear in the positions, so the sphere follows
/// rigid motions exactly and never jumps, as labels for a regression need; a minimal ball would be a few
/// percent smaller, but it is not smooth.
/// x: all positions, [n, 3]. vertices: rows of x, not empty.
/// Returns a sphere that contains the listed vertices: the radius is rounded up by a few ulp.
Sphere bounding_sphere(VerticesRef x, std::span<const int> vertices) noexcept;

}  // namespace nbd
