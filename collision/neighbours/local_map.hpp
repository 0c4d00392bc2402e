#pragma once

#include <Eigen/Geometry>
#include <span>

#include "collision/geometry/tet_mesh.hpp"

namespace nbd {

/// A quadratic map of space, q(z) = c + A z + (terms of second order), that follows a small part of a surface
/// as it turns, stretches and bends. Column k of the coefficients belongs to term k of terms().
using LocalMap = Eigen::Matrix<double, 3, 10>;
using MapTerms = Eigen::Matrix<double, 10, 1>;

/// Points of a region, [3, n], over its size and around its centre; and the terms at each, [10, n]: 1, z,
/// squares, mixed products.
inline constexpr int most_region_vertices = 256;
using LocalPoints = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor, 3, most_region_vertices>;
using TermMatrix = Eigen::Matrix<double, 10, Eigen::Dynamic, Eigen::RowMajor, 10, most_region_vertices>;

LocalPoints local_points(const Nodes& x, std::span<const int> vertices, const Eigen::Vector3d& centre,
                         double size);
/// From 3 n numbers: first coordinates, second ones, third ones.
LocalPoints local_points(std::span<const float> numbers);
TermMatrix terms(const LocalPoints& Z);

/// Derivative of terms() at z along n.
template <class Point>
MapTerms term_slopes(const Point& z, const Eigen::Vector3d& n) {
    MapTerms b;
    b << 0, n[0], n[1], n[2], 2 * z[0] * n[0], 2 * z[1] * n[1], 2 * z[2] * n[2], z[1] * n[2] + z[2] * n[1],
        z[2] * n[0] + z[0] * n[2], z[0] * n[1] + z[1] * n[0];
    return b;
}

/// What a local map does to distances in a box around the origin.
struct MapBound {
    /// |q(x) - q(y)| >= stretch |x - y| for all x, y in the box. Nothing is known if it is <= 0 or NaN.
    double stretch;
    /// The norm of the second derivative along any unit vector is no larger.
    double bend;
};

/// half: half the sides of the box.
MapBound bound_of(const LocalMap& q, const Eigen::Vector3d& half);

}  // namespace nbd
