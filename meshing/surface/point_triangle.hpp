#pragma once

#include <Eigen/Core>

namespace nbd {

/// Squared distance from p to the closest point of triangle a b c, degenerate ones included, in double
/// precision: for rest poses (collision/ has the exact and the fast ones of float32).
double squared_distance_to_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                    const Eigen::Vector3d& b, const Eigen::Vector3d& c) noexcept;

}  // namespace nbd
