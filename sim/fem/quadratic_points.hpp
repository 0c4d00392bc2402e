#pragma once

#include <Eigen/Core>
#include <array>
#include <span>

#include "sim/materials/element_tangent.hpp"
#include "sim/materials/polar.hpp"

namespace nbd {

/// The points of integration of a tetrahedron, one row each: barycentric coordinates.
using TetPoints = Eigen::Matrix4d;

/// Four points of equal weight that integrate quadratic polynomials exactly over the material in a
/// tetrahedron. Of a full one: the rule of [HammerStroud56], where one coordinate of each point is
/// (5 + 3 sqrt 5) / 20 and the others are (5 - sqrt 5) / 20. Where little is filled they may lie outside of
/// it. fill: a row of TetFill, or of full ones; with a positive sum.
TetPoints points_of_fill(const Eigen::Matrix<double, 1, 10>& fill);

/// Means over a tetrahedron of the products of its ten shape functions.
using ShapeProducts = Eigen::Matrix<double, 10, 10>;
/// Of a full one.
ShapeProducts products_in_full_tet();
/// At four points of equal weight: where these are points_of_fill(), products of two functions of position
/// that are linear come out exactly, so that mass, its centre and its inertia do.
ShapeProducts products_at(const TetPoints& points);

/// Multiplies the matrices of each four lanes by those of their tetrahedra: what is linear in between, from
/// corners to points.
void mix_lanes(const std::array<const TetPoints*, lanes / 4>& points, LaneMatrix3& matrices) noexcept;
/// Likewise by the transposed ones: turns stresses at the points into those that belong to the corners.
void mix_lanes_transposed(const std::array<const TetPoints*, lanes / 4>& points,
                          LaneMatrix3& matrices) noexcept;

/// The stiffness of a quadratic tetrahedron. of_points: at each point, that of a linear tetrahedron with the
/// shape of its corner tetrahedra, and the volume that belongs to the point.
QuadraticTetBlocks stiffness_of_points(const TetPoints& points,
                                       std::span<const TetBlocks, 4> of_points) noexcept;

}  // namespace nbd
