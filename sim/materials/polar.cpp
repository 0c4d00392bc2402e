#include "sim/materials/polar.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>

namespace nbd {
namespace {

using Mask = Eigen::Array<bool, lanes, 1>;

Eigen::Matrix3d rotation_by_svd(const Eigen::Matrix3d& F) noexcept {
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(F, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Matrix3d U = svd.matrixU();
    if (U.determinant() * svd.matrixV().determinant() < 0) U.col(2) = -U.col(2);
    return U * svd.matrixV().transpose();
}

/// Returns the cofactors of A and sets det to its determinant.
LaneMatrix3 cofactors(const LaneMatrix3& A, Lanes& det) noexcept {
    LaneMatrix3 C;
    for (int j = 0; j < 3; ++j) {
        const int k = (j + 1) % 3, l = (j + 2) % 3;
        for (int i = 0; i < 3; ++i) {
            const int m = (i + 1) % 3, n = (i + 2) % 3;
            C(i, j) = A(m, k) * A(n, l) - A(n, k) * A(m, l);
        }
    }
    det = A(0, 0) * C(0, 0) + A(1, 0) * C(1, 0) + A(2, 0) * C(2, 0);
    return C;
}

Lanes squared_norm(const LaneMatrix3& A) noexcept {
    Lanes sum = A.entries[0].square();
    for (std::size_t k = 1; k < 9; ++k) sum += A.entries[k].square();
    return sum;
}

}  // namespace

Eigen::Matrix3d LaneMatrix3::lane(int l) const noexcept {
    Eigen::Matrix3d A;
    for (int k = 0; k < 9; ++k) A(k % 3, k / 3) = entries[k][l];
    return A;
}

void LaneMatrix3::set_lane(int l, const Eigen::Matrix3d& A) noexcept {
    for (int k = 0; k < 9; ++k) entries[k][l] = A(k % 3, k / 3);
}

// Newton's iteration R <- (s R + (s R)^-T) / 2. The scaling s [Higham86] first brings the singular values
// near one; then each step doubles the correct digits. Only for F far from flat; otherwise an SVD is used.
void rotations_of(const LaneMatrix3& F, LaneMatrix3& R) noexcept {
    constexpr int scaled_iterations = 3, max_iterations = 12;
    constexpr double converged = 1e-9;  // the following step is below rounding
    Lanes det;
    LaneMatrix3 C = cofactors(F, det);
    const Lanes size = squared_norm(F);
    const Mask regular = det > 1e-3 * size * size.sqrt();  // also false for NaN
    for (int k = 0; k < 9; ++k) R.entries[k] = regular.select(F.entries[k], Lanes::Constant(k % 4 == 0));
    Mask done = Mask::Constant(false);
    for (int k = 0; k < max_iterations && !done.all(); ++k) {
        C = cofactors(R, det);
        Lanes scale = Lanes::Ones();
        if (k < scaled_iterations) scale = (squared_norm(C) / (det.square() * squared_norm(R))).sqrt().sqrt();
        const Lanes own = 0.5 * scale, inverse = 0.5 / (scale * det);
        Lanes step = Lanes::Zero();
        for (std::size_t e = 0; e < 9; ++e) {
            const Lanes next = own * R.entries[e] + inverse * C.entries[e];
            step += (next - R.entries[e]).square();
            R.entries[e] = next;
        }
        done = step < converged * converged;
    }
    for (int l = 0; l < lanes; ++l) {
        if (regular[l] && done[l]) continue;
        const Eigen::Matrix3d A = F.lane(l);
        R.set_lane(l, A.allFinite() ? rotation_by_svd(A) : Eigen::Matrix3d::Identity());
    }
}

Eigen::Matrix3d rotation_of(const Eigen::Matrix3d& F) noexcept {
    LaneMatrix3 all, R;
    for (int l = 0; l < lanes; ++l) all.set_lane(l, F);
    rotations_of(all, R);
    return R.lane(0);
}

}  // namespace nbd
