#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>

#include "collision/neighbours/local_map.hpp"
#include "collision/wide_tree/wide_tree.hpp"

namespace nbd {

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

}  // namespace nbd
