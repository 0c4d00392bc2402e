#pragma once

#include <Eigen/Core>

namespace nbd {

/// The rotation R (det = +1) that maximises tr(R^T F): the polar factor of F, also for inverted and flat F,
/// where the direction of least stretch is the one taken as mirrored. R^T F is symmetric. The same R is
/// returned for the same F, without history. Not unique where the two smallest signed singular values
/// add up to zero; identity for a non-finite F.
Eigen::Matrix3d rotation_of(const Eigen::Matrix3d& F) noexcept;

}  // namespace nbd
