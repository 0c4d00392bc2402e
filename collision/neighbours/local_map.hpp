#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <span>

#include "collision/geometry/tet_mesh.hpp"
#include "collision/wide_tree/wide_tree.hpp"

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

/// Unit normal of the face between three points; zero if they lie on a line.
inline Eigen::Vector3d unit_normal(const Eigen::Vector3d& p, const Eigen::Vector3d& q,
                                   const Eigen::Vector3d& r) {
    const Eigen::Vector3d n = (q - p).cross(r - p);
    const double length = n.norm();
    if (length > 0) return n / length;
    return Eigen::Vector3d::Zero();
}

/// A map is fitted to the points of a region and to the normals of the leaf's faces, without which nothing
/// would tell how a flat part turns. Calls f(slopes, weight, i, j, k) for some faces of a leaf: slopes of the
/// terms along its normal, its weight in the fit, and its corners. Z: points of the region at rest, those of
/// the leaf first.
template <class F>
void for_each_normal(const WideTree& tree, int leaf, const LocalPoints& Z, const F& f) {
    const std::size_t l = leaf;
    constexpr int step = 4;         // a quarter of the faces tells how the leaf turns
    constexpr double share = 1e-3;  // small beside what the points of a curved part tell
    const double weight = share * static_cast<double>(Z.cols() * step) / tree.faces_in[l];
    for (int k = 0; k < tree.faces_in[l]; k += step) {
        const std::uint8_t* corner = tree.corners[l].data() + k;
        const int p = corner[0], q = corner[tree_width], r = corner[2 * tree_width];
        const Eigen::Vector3d centre = (Z.col(p) + Z.col(q) + Z.col(r)) / 3;
        f(term_slopes(centre, unit_normal(Z.col(p), Z.col(q), Z.col(r))), weight, p, q, r);
    }
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
