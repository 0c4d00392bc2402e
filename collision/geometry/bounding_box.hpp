#pragma once

#include <span>

#include "collision/geometry/box.hpp"
#include "collision/geometry/positions.hpp"

namespace nbd {

/// Smallest box around the listed vertices, at least one; NaN on an axis on which a position is not finite.
/// Call x.require(vertices) first.
Box bounding_box(const Positions& x, std::span<const int> vertices) noexcept;

/// The sphere around a box; contains the box despite rounding.
Sphere sphere_around(const Box& box) noexcept;

}  // namespace nbd
