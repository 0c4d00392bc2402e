#include "collision/bounds/certified/enclosing_ellipsoid.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace nbd {
namespace {

/// Weights of the points such that their weighted covariance has the shape of the smallest ellipsoid. The
/// point farthest out in the current shape gains weight until none is far out.
Eigen::VectorXd khachiyan_weights(const std::vector<Eigen::Vector3d>& points, double thickness) {
    constexpr int max_steps = 200;
    constexpr double tolerance = 0.02;
    const auto n = static_cast<Eigen::Index>(points.size());
    Eigen::Matrix4Xd lifted(4, n);
    for (Eigen::Index i = 0; i < n; ++i) lifted.col(i) << points[static_cast<std::size_t>(i)], 1;
    Eigen::VectorXd weights = Eigen::VectorXd::Constant(n, 1.0 / static_cast<double>(n));
    for (int step = 0; step < max_steps; ++step) {
        Eigen::Matrix4d moments = lifted * weights.asDiagonal() * lifted.transpose();
        moments.diagonal().head<3>().array() += thickness * thickness;
        Eigen::Index farthest = 0;
        const double most =
            (lifted.array() * (moments.inverse() * lifted).array()).colwise().sum().maxCoeff(&farthest);
        if (most < 4 * (1 + tolerance)) break;
        const double gain = (most - 4) / (4 * (most - 1));
        weights *= 1 - gain;
        weights[farthest] += gain;
    }
    return weights;
}

/// How far out the farthest point is in units of the ellipsoid; 1 on its surface.
double reach_of(const Ellipsoid& ellipsoid, const std::vector<Eigen::Vector3d>& points) {
    const Eigen::Matrix3d inverse = ellipsoid.B.cast<double>().inverse();
    double reach = 0;
    for (const Eigen::Vector3d& p : points)
        reach = std::max(reach, (inverse * (p - ellipsoid.m.cast<double>())).norm());
    return reach;
}

}  // namespace

Ellipsoid enclosing_ellipsoid(const std::vector<Eigen::Vector3d>& points) {
    double size = 0;
    for (const Eigen::Vector3d& p : points) size = std::max(size, (p - points.front()).norm());
    const double thickness = 1e-3 * size + 1e-6 * points.front().norm();
    if (thickness == 0) return {};
    const Eigen::VectorXd weights = khachiyan_weights(points, thickness);
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < points.size(); ++i) mean += weights[static_cast<Eigen::Index>(i)] * points[i];
    Eigen::Matrix3d covariance = thickness * thickness * Eigen::Matrix3d::Identity();
    for (std::size_t i = 0; i < points.size(); ++i)
        covariance +=
            weights[static_cast<Eigen::Index>(i)] * (points[i] - mean) * (points[i] - mean).transpose();
    const Eigen::Matrix3d shape = covariance.llt().matrixL();
    Ellipsoid result{mean.cast<float>(), shape.cast<float>()};
    // Measured with the rounded float32 numbers, so that their rounding is covered.
    for (double reach = reach_of(result, points); reach > 1; reach = reach_of(result, points))
        result.B *= static_cast<float>(reach * (1 + 1e-6));
    return result;
}

}  // namespace nbd
