#pragma once

#include "collision/geometry/geometry.hpp"

namespace nbd {

/// The closest points of two features a and b.
struct ClosestPoints {
    Eigen::Vector3d a, b;                  // the points, metres
    Eigen::Vector3d weights_a, weights_b;  // weights of the feature's corners, >= 0, sum 1; unused ones are 0
    Eigen::Vector3d gap;                   // a - b, more accurate than the difference of the two points
    double distance;                       // |gap|
};

/// Closest points of closed features, in double precision. A degenerate feature counts as the segment or
/// point that it is. Results are never NaN for coordinates in float's range. Of several equally close pairs,
/// one is returned.

/// a: the point p. b: the triangle uvw.
ClosestPoints closest_point_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& u,
                                     const Eigen::Vector3d& v, const Eigen::Vector3d& w) noexcept;

/// a: the segment pq. b: the segment uv.
ClosestPoints closest_edge_edge(const Eigen::Vector3d& p, const Eigen::Vector3d& q, const Eigen::Vector3d& u,
                                const Eigen::Vector3d& v) noexcept;

/// If triangles_intersect(a, b), distance and gap are 0 and both points are one common point, the middle of
/// the common segment if the triangles cross; each is computed from its own triangle, and they agree to 1e-10
/// of the size. Otherwise the gap is accurate to about 1e-15 of the triangles' size and distance.
ClosestPoints closest_triangle_triangle(const Triangle& a, const Triangle& b) noexcept;

/// The distance that closest_triangle_triangle(a, b) reports, metres.
double triangle_distance(const Triangle& a, const Triangle& b) noexcept;

}  // namespace nbd
