#pragma once

#include <Eigen/Core>
#include <vector>

namespace nbd {

/// The set {m + B w, |w| <= 1}.
struct Ellipsoid {
    Eigen::Vector3f m = Eigen::Vector3f::Zero();
    Eigen::Matrix3f B = Eigen::Matrix3f::Zero();
};

/// An ellipsoid that contains all points despite rounding and is close to the smallest one [Khachiyan96].
/// points: not empty, finite.
Ellipsoid enclosing_ellipsoid(const std::vector<Eigen::Vector3d>& points);

}  // namespace nbd
