#include "sim/polar.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>

namespace nbd {
namespace {

Eigen::Matrix3d rotation_by_svd(const Eigen::Matrix3d& F) noexcept {
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(F, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Matrix3d U = svd.matrixU();
    if (U.determinant() * svd.matrixV().determinant() < 0) U.col(2) = -U.col(2);
    return U * svd.matrixV().transpose();
}

Eigen::Matrix3d cofactors(const Eigen::Matrix3d& A) noexcept {
    Eigen::Matrix3d C;
    C.col(0) = A.col(1).cross(A.col(2));
    C.col(1) = A.col(2).cross(A.col(0));
    C.col(2) = A.col(0).cross(A.col(1));
    return C;
}

}  // namespace

// Newton's iteration R <- (s R + (s R)^-T) / 2 with the scaling of [Higham86] doubles the correct digits each
// time where F is well away from flat; singular values decide elsewhere.
Eigen::Matrix3d rotation_of(const Eigen::Matrix3d& F) noexcept {
    if (!F.allFinite()) return Eigen::Matrix3d::Identity();
    const double size = F.norm();
    if (!(F.determinant() > 1e-3 * size * size * size)) return rotation_by_svd(F);
    constexpr int max_iterations = 12;
    constexpr double converged = 1e-9;  // the step after it is below rounding
    Eigen::Matrix3d R = F;
    for (int k = 0; k < max_iterations; ++k) {
        const Eigen::Matrix3d C = cofactors(R);
        const double det = R.col(0).dot(C.col(0));
        const double scale = std::sqrt(C.norm() / (det * R.norm()));
        const Eigen::Matrix3d next = 0.5 * (scale * R + C / (scale * det));
        const double step = (next - R).norm();
        R = next;
        if (step < converged) return R;
    }
    return rotation_by_svd(F);
}

}  // namespace nbd
