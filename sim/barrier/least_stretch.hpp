#pragma once

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace nbd {

/// The least singular value of a deformation gradient, less rounding.
inline double least_stretch(const Eigen::Matrix3d& F) {
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
    solver.computeDirect(F.transpose() * F, Eigen::EigenvaluesOnly);
    constexpr double rounding = 1e-6;  // of the least root, by the largest
    return std::sqrt(std::max(solver.eigenvalues()[0], 0.0)) - rounding * std::sqrt(solver.eigenvalues()[2]);
}

/// At most that of all gradients on the straight way from one to another.
inline double least_stretch(const Eigen::Matrix3d& begin, const Eigen::Matrix3d& end) {
    return (least_stretch(begin) + least_stretch(end) - (end - begin).norm()) / 2;
}

}  // namespace nbd
