#pragma once

#include "collision/closest_points.hpp"

namespace nbd {

/// How two faces of closed surfaces meet, for a contact force.
struct TriangleContact {
    ClosestPoints at;        // where to push: the closest points, or one common point
    Eigen::Vector3d normal;  // unit, from b to a: a moves out of b along it
    double depth;            // metres: > 0 penetration, < 0 minus the distance, 0 they just touch
};

/// One meaning on both sides of zero: once a has moved by depth * normal, the triangles at most touch.
/// Apart: normal points from the closest point of b to that of a, and depth is minus the distance.
/// Intersecting: normal is one of the face normals and edge-edge cross products, the directions in which
/// convex sets part with the least translation. Each is taken the way that does not oppose b's outward
/// normal minus a's, so that a leaves b's surface through its outside however deep it is; of these ways the
/// one with the least translation counts.
/// Where rounding leaves a gap no direction, normal is chosen among the same ones, either way round.
/// Degenerate triangles are served; where nothing sets a direction (two points), it is some unit vector.
/// Never NaN.
TriangleContact triangle_contact(const Triangle& a, const Triangle& b) noexcept;

}  // namespace nbd
