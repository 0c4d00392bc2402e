#pragma once

#include <Eigen/Core>
#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>

#include "collision/continuous/impact.hpp"
#include "collision/geometry/closest_points.hpp"

namespace nbd {

enum class FeatureKind : std::uint8_t { vertex_face, edge_edge };

/// Two features of surfaces that must not meet: a vertex of one surface and a face of the other, or an edge
/// of each. Both may be of one surface; they have no vertex in common then.
struct FeaturePair {
    FeatureKind kind = FeatureKind::vertex_face;
    int surface_a = 0, surface_b = 0;
    int a = 0, b = 0;  // vertex and face, or the edges
    auto operator<=>(const FeaturePair&) const = default;
};

/// Of the four corners of a pair, those of surface a come first: the vertex, or the ends of edge a. Their
/// number; the other corners are of b.
constexpr std::size_t corners_of_a(FeatureKind kind) noexcept {
    return kind == FeatureKind::vertex_face ? 1 : 2;
}

/// x: the vertex and the corners of the face, or the ends of edge a and of edge b.
inline ClosestPoints closest_points(FeatureKind kind, const std::array<Eigen::Vector3d, 4>& x) noexcept {
    return kind == FeatureKind::vertex_face ? closest_point_triangle(x[0], x[1], x[2], x[3])
                                            : closest_edge_edge(x[0], x[1], x[2], x[3]);
}

/// vertex_face_impact() or edge_edge_impact() of such corners.
inline Impact feature_impact(FeatureKind kind, const std::array<MovingPoint, 4>& x,
                             const ImpactConfig& config = {}) noexcept {
    return kind == FeatureKind::vertex_face ? vertex_face_impact(x[0], x[1], x[2], x[3], config)
                                            : edge_edge_impact(x[0], x[1], x[2], x[3], config);
}

}  // namespace nbd
