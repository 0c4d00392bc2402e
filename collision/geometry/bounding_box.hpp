#pragma once

#include <span>

#include "collision/geometry/box.hpp"
#include "collision/geometry/positions.hpp"

namespace nbd {

/// The smallest box around some vertices of a pose, all of them required before; at least one.
Box bounding_box(const Positions& x, std::span<const int> vertices) noexcept;

/// The sphere around a box. Contains it, rounding included.
Sphere sphere_around(const Box& box) noexcept;

}  // namespace nbd
