#pragma once

#include <Eigen/Core>
#include <vector>

namespace nbd {

/// {m + B w, |w| <= 1}.
struct Ellipsoid {
    Eigen::Vector3f m = Eigen::Vector3f::Zero();
    Eigen::Matrix3f B = Eigen::Matrix3f::Zero();
};

/// An ellipsoid around points, about the smallest [Khachiyan96], that contains them all, rounding included.
/// points: not empty, finite.
Ellipsoid enclosing_ellipsoid(const std::vector<Eigen::Vector3d>& points);

}  // namespace nbd
