#pragma once

#include <Eigen/Core>

namespace nbd {

/// Squared distance from p to the closest point of triangle a b c, which may be degenerate. Double precision,
/// for rest poses; collision/ has the exact and fast float32 versions.
double squared_distance_to_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                    const Eigen::Vector3d& b, const Eigen::Vector3d& c) noexcept;

}  // namespace nbd
