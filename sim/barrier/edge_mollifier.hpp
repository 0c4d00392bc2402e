#pragma once

#include <Eigen/Core>

namespace nbd {

/// The weight of the potential between two edges:
///
///   m = q (2 - q) for q < 1, otherwise 1,   q = |u x w|^2 / (10^-3 |U|^2 |W|^2)
///
/// The closest points of two edges jump where these become parallel. There the weight vanishes, so that the
/// force between them does not jump. What keeps parallel edges apart is the potential between their ends and
/// the faces beside them. u, w: the edges, each as the difference of its ends, metres. rest_u, rest_w: their
/// squared lengths at rest, |U|^2 and |W|^2. Source: [Li20], section 5.
double edge_mollifier(const Eigen::Vector3d& u, const Eigen::Vector3d& w, double rest_u,
                      double rest_w) noexcept;

}  // namespace nbd
