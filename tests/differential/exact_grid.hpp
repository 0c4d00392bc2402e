#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

// Geometry of small whole numbers, exact in 64 bits and written for nothing but to be right: the truth that
// the library's geometry is compared with. Coordinates are at most 64 in size. A triangle may be a segment or
// a point.
namespace nbd::test {

using GridPoint = Eigen::Matrix<std::int64_t, 3, 1>;
using GridTriangle = std::array<GridPoint, 3>;

/// Whether two closed triangles have a point in common.
bool grid_triangles_intersect(const GridTriangle& s, const GridTriangle& t);

/// Squares of distances; each is one quotient of whole numbers, rounded once.
double grid_point_triangle(const GridPoint& p, const GridTriangle& t);
double grid_edge_edge(const GridPoint& p, const GridPoint& q, const GridPoint& u, const GridPoint& v);
double grid_triangle_triangle(const GridTriangle& s, const GridTriangle& t);

}  // namespace nbd::test
