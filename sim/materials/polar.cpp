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

namespace {

LaneMatrix3 identity() noexcept {
    LaneMatrix3 I;
    for (int k = 0; k < 9; ++k) I.entries[k] = Lanes::Constant(k % 4 == 0);
    return I;
}

/// One rotation of Jacobi's method: makes entry (p, q) of A zero and turns the columns p and q of V.
void rotate(SymmetricLanes& A, LaneMatrix3& V, int axis) noexcept {
    const int p = (axis + 1) % 3, q = (axis + 2) % 3;
    const std::size_t i = axis, j = p, k = q;
    const Lanes off = A.off[i], difference = A.diagonal[k] - A.diagonal[j];
    const Lanes size = difference.abs() + (difference.square() + 4 * off.square()).sqrt();
    // The tangent of the smaller of the two angles that do it.
    const Lanes ratio = (size > 0).select(2 * off / size, 0.0), t = (difference < 0).select(-ratio, ratio);
    const Lanes c = (1 + t.square()).rsqrt(), s = t * c;
    A.diagonal[j] -= t * off;
    A.diagonal[k] += t * off;
    A.off[i].setZero();
    const Lanes a = A.off[k], b = A.off[j];  // entries (axis, p) and (axis, q)
    A.off[k] = c * a - s * b;
    A.off[j] = s * a + c * b;
    for (int row = 0; row < 3; ++row) {
        const Lanes u = V(row, p), v = V(row, q);
        V(row, p) = c * u - s * v;
        V(row, q) = s * u + c * v;
    }
}

}  // namespace

// Jacobi's cyclic method converges quadratically: it ends where no more than rounding is left, usually after
// five sweeps.
LaneMatrix3 diagonalise(SymmetricLanes& A) noexcept {
    constexpr int max_sweeps = 8;
    LaneMatrix3 V = identity();
    for (int sweep = 0; sweep < max_sweeps; ++sweep) {
        Lanes off = Lanes::Zero(), all = Lanes::Zero();
        for (std::size_t i = 0; i < 3; ++i) {
            off += A.off[i].square();
            all += A.diagonal[i].square();
        }
        if (!(off > 1e-32 * all).any()) break;  // NaN ends it too
        for (int axis = 2; axis >= 0; --axis) rotate(A, V, axis);
    }
    return V;
}

PrincipalStretches principal_stretches(const LaneMatrix3& F, const LaneMatrix3& R) noexcept {
    const auto entry = [&](int i, int j) -> Lanes {
        return R(0, i) * F(0, j) + R(1, i) * F(1, j) + R(2, i) * F(2, j);
    };
    SymmetricLanes S;
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        S.diagonal[i] = entry(i, i);
        S.off[i] = 0.5 * (entry(j, k) + entry(k, j));
    }
    PrincipalStretches result;
    result.V = diagonalise(S);
    result.sigma = S.diagonal;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            result.U(i, j) = R(i, 0) * result.V(0, j) + R(i, 1) * result.V(1, j) + R(i, 2) * result.V(2, j);
    return result;
}

void clamp_eigenvalues(SymmetricLanes& A) noexcept {
    // Most matrices need nothing: all leading minors are positive.
    const auto& [d, o] = A;
    const Lanes minor = d[0] * d[1] - o[2].square();
    const Lanes det = d[2] * minor - d[0] * o[0].square() - d[1] * o[1].square() + 2 * o[0] * o[1] * o[2];
    if ((d[0] > 0 && minor > 0 && det > 0).all()) return;
    const LaneMatrix3 V = diagonalise(A);
    const PrincipalLanes value{A.diagonal[0].max(0.0), A.diagonal[1].max(0.0), A.diagonal[2].max(0.0)};
    const auto entry = [&](int i, int j) -> Lanes {
        return value[0] * V(i, 0) * V(j, 0) + value[1] * V(i, 1) * V(j, 1) + value[2] * V(i, 2) * V(j, 2);
    };
    for (int i = 0; i < 3; ++i) {
        A.diagonal[i] = entry(i, i);
        A.off[i] = entry((i + 1) % 3, (i + 2) % 3);
    }
}

}  // namespace nbd
