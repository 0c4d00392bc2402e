#pragma once

#include <span>

#include "sim/materials/element_tangent.hpp"
#include "sim/materials/polar.hpp"

namespace nbd {

/// The rule of four points in a tetrahedron, exact for quadratic polynomials [HammerStroud56]: at point a,
/// the barycentric coordinate of corner a is `far_corners` + `own_corner`, those of the others `far_corners`.
struct QuadraticRule {
    static constexpr double far_corners = 0.13819660112501052;  // (5 - sqrt 5) / 20
    static constexpr double own_corner = 0.44721359549995793;   // 1 / sqrt 5

    static constexpr double coordinate(int point, int corner) noexcept {
        return far_corners + (point == corner ? own_corner : 0);
    }
};

/// Turns matrices at the four corners of each of lanes / 4 tetrahedra into those at their points, where they
/// are linear in between. The map is symmetric: it also turns stresses at the points into those that belong
/// to the corners.
void move_to_points(LaneMatrix3& of_corners) noexcept;

/// The stiffness of a quadratic tetrahedron. of_points: at each point, that of a linear tetrahedron with the
/// shape of its corner tetrahedra, and the volume that belongs to the point.
QuadraticTetBlocks stiffness_of_points(std::span<const TetBlocks, 4> of_points) noexcept;

}  // namespace nbd
