#pragma once

#include "collision/geometry/geometry.hpp"

namespace nbd {

/// Where two features a and b come closest.
struct ClosestPoints {
    Eigen::Vector3d a, b;                  // the points, metres
    Eigen::Vector3d weights_a, weights_b;  // of the feature's corners: >= 0, sum 1; unused ones are 0
    Eigen::Vector3d gap;                   // a - b, without the rounding of the two points
    double distance;                       // |gap|
};

/// Closest points of closed features, in double. Features may be degenerate (a segment, a point): the
/// answer is then that of what they have become. Never NaN for coordinates in float's range.
/// Where several pairs are equally close, one of them.

/// a: the point p. b: the triangle uvw.
ClosestPoints closest_point_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& u,
                                     const Eigen::Vector3d& v, const Eigen::Vector3d& w) noexcept;

/// a: the segment pq. b: the segment uv.
ClosestPoints closest_edge_edge(const Eigen::Vector3d& p, const Eigen::Vector3d& q, const Eigen::Vector3d& u,
                                const Eigen::Vector3d& v) noexcept;

/// Where triangles_intersect(a, b), distance and gap are 0 and the points are one common point, each
/// computed from its own triangle (they agree to 1e-10 of the size): the middle of their common segment
/// where they cross. Elsewhere the gap is right to some 1e-15 of the triangles' size and mutual distance.
ClosestPoints closest_triangle_triangle(const Triangle& a, const Triangle& b) noexcept;

/// The distance that closest_triangle_triangle(a, b) reports, metres.
double triangle_distance(const Triangle& a, const Triangle& b) noexcept;

}  // namespace nbd
