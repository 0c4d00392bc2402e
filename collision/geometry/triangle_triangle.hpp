#pragma once

#include <array>

#include "collision/geometry/geometry.hpp"

namespace nbd {

/// Whether two closed triangles have a point in common: crossing, coplanar overlap, and touching in a
/// face, an edge or a vertex all count. Exact for every finite input, degenerate triangles (segments,
/// points) included: orientation tests run in filtered double and fall back to exact expansions if rounding
/// could change the sign. Source: [GuigueDevillers03], [Shewchuk97].
bool triangles_intersect(const Triangle& s, const Triangle& t) noexcept;

/// Corners of a triangle in double precision.
using TriangleCorners = std::array<Eigen::Vector3d, 3>;

/// The same, as exact; products of three differences of coordinates must not over- or underflow.
bool double_triangles_intersect(const TriangleCorners& s, const TriangleCorners& t) noexcept;

}  // namespace nbd
