#include "collision/nbd_tree/shape_matching.hpp"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <limits>

namespace nbd {
namespace {

/// Sum of w (x, 1) (X, 1)^T relative to the first points, so that no digits are lost far from the origin.
Eigen::Matrix4d weighted_moments(VerticesRef X, VerticesRef x, Eigen::Ref<const Eigen::VectorXf> w) noexcept {
    const double X0 = X(0, 0), X1 = X(0, 1), X2 = X(0, 2), x0 = x(0, 0), x1 = x(0, 1), x2 = x(0, 2);
    double sums[4][4] = {};  // plain arrays, which the compiler keeps in registers
    for (Eigen::Index i = 0; i < X.rows(); ++i) {
        const double weight = w[i];
        const double from[4] = {weight * (X(i, 0) - X0), weight * (X(i, 1) - X1), weight * (X(i, 2) - X2),
                                weight};
        const double to[4] = {x(i, 0) - x0, x(i, 1) - x1, x(i, 2) - x2, 1};
        for (int column = 0; column < 4; ++column)
            for (int row = 0; row < 4; ++row) sums[column][row] += from[column] * to[row];
    }
    return Eigen::Map<const Eigen::Matrix4d>(&sums[0][0]);
}

}  // namespace

RigidTransform match_shape(VerticesRef X, VerticesRef x, Eigen::Ref<const Eigen::VectorXf> w) noexcept {
    const Eigen::Matrix4d moments = weighted_moments(X, x, w);
    const double total = moments(3, 3);
    const Eigen::Vector3d mean_X = moments.row(3).head<3>().transpose() / total,
                          mean_x = moments.col(3).head<3>() / total;
    Eigen::Matrix3d A = moments.topLeftCorner<3, 3>() - total * mean_x * mean_X.transpose();
    // Points on a line or in one place do not determine R; this term picks the R nearest to the identity. For
    // all other points it is far below float precision.
    A.diagonal().array() += 1e-10 * A.norm();

    RigidTransform align;
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(A, Eigen::ComputeFullU | Eigen::ComputeFullV);
    // The decomposition fails only for numbers that are not finite. Then no coordinate may look like one.
    Eigen::Matrix3d R = Eigen::Matrix3d::Constant(std::numeric_limits<double>::quiet_NaN());
    if (svd.info() == Eigen::Success) {
        const bool reflected = svd.matrixU().determinant() * svd.matrixV().determinant() < 0;
        const Eigen::Vector3d signs(1, 1, reflected ? -1 : 1);
        R = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
    }
    align.R = R.cast<float>();
    const Eigen::Vector3d X0 = X.row(0).transpose().cast<double>(), x0 = x.row(0).transpose().cast<double>();
    align.t = (x0 + mean_x - R * (X0 + mean_X)).cast<float>();
    return align;
}

}  // namespace nbd
