#pragma once

#include <array>
#include <span>
#include <vector>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Cuts a polygon into corners.size() - 2 triangles on its own corners, with its orientation, by ear clipping
/// in the plane of its mean normal. A polygon that is not simple in that plane gives overlapping triangles.
/// corners: three or more rows of X.
std::vector<std::array<int, 3>> triangulate_polygon(NodesRef X, std::span<const int> corners);

}  // namespace nbd
