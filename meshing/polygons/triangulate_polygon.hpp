#pragma once

#include <array>
#include <span>
#include <vector>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Cuts a polygon into corners.size() - 2 triangles on its own corners, with its orientation: by the
/// constrained Delaunay triangulation in the plane of its mean normal, in n log n steps. Where its sides
/// cross or corners coincide in that plane, there is no such cut; then a fan around the first corner, whose
/// triangles overlap there, keeps the surface closed. corners: three or more rows of X, which are finite.
std::vector<std::array<int, 3>> triangulate_polygon(NodesRef X, std::span<const int> corners);

}  // namespace nbd
