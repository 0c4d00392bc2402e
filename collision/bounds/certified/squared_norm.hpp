#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>

namespace nbd {

/// Upper bound on the squared largest singular value of 3x3 matrices, one per lane, entries column by column:
/// never below the exact value, at most 3 % above it, and mostly less than 0.1 %. NaN in lanes with a NaN
/// entry. Lanes: an Eigen array of floating-point numbers.
///
/// Proof. C = A^T A has the eigenvalues m + 2 p cos(phi + 2 pi k / 3) with m = tr C / 3, 6 p^2 = |C - m I|^2
/// (Frobenius) and cos(3 phi) = h = det(C - m I) / (2 p^3), 0 <= phi <= pi / 3. The largest is m + 2 p c,
/// c = cos phi in [1/2, 1], the largest root of q(c) = 4 c^3 - 3 c - h. On [1/2, 1] q is convex and does not
/// decrease, so Newton's steps from c = 1, where q >= 0, go down towards c and never past it. A larger h
/// gives a larger c.
///
/// Rounding, with the machine epsilon e and q = p / m <= 1. An entry of C is off by at most 9 e m, m by 5 e
/// m, q by 25 e and an entry of (C - m I) / p by 80 e / q. While e / q is small, that changes h by less than
/// 1024 e / q; otherwise this allowance makes h = 1 and c = 1, an upper bound for every h. The last factor
/// covers the errors of m (5 e m), 2 m q (50 e m), the steps (40 e m) and its own; the last term covers
/// underflow in C.
template <class Lanes>
Lanes squared_norm_bound(const std::array<Lanes, 9>& A) noexcept {
    using Real = typename Lanes::Scalar;
    constexpr Real e = std::numeric_limits<Real>::epsilon(), least = std::numeric_limits<Real>::min();
    const auto product = [&](std::size_t i, std::size_t j) -> Lanes {
        return A[3 * i] * A[3 * j] + A[3 * i + 1] * A[3 * j + 1] + A[3 * i + 2] * A[3 * j + 2];
    };
    const Lanes C00 = product(0, 0), C11 = product(1, 1), C22 = product(2, 2);
    const Lanes xy = product(0, 1), xz = product(0, 2), yz = product(1, 2);
    const Lanes m = (C00 + C11 + C22) * Real(1.0 / 3), per_m = (m + least).inverse();
    const Lanes x = (C00 - m) * per_m, y = (C11 - m) * per_m, z = (C22 - m) * per_m;
    const Lanes a = xy * per_m, b = xz * per_m, d = yz * per_m;
    const Lanes q =
        ((x.square() + y.square() + z.square() + 2 * (a.square() + b.square() + d.square())) * Real(1.0 / 6))
            .sqrt();
    const Lanes per_q = (q + least).inverse();
    const Lanes X = x * per_q, Y = y * per_q, Z = z * per_q, A01 = a * per_q, A02 = b * per_q,
                A12 = d * per_q;
    const Lanes det = X * (Y * Z - A12.square()) - A01 * (A01 * Z - A12 * A02) + A02 * (A01 * A12 - Y * A02);
    const Lanes h = (Real(0.5) * det + 1024 * e * per_q).min(Real(1));
    Lanes c = Lanes::Ones();
    for (int step = 0; step < 4; ++step) {
        const Lanes squared = c.square();
        c = (8 * c * squared + h) / (12 * squared - 3);
    }
    return m * (1 + 2 * q * c) * (1 + 128 * e) + 64 * least;
}

}  // namespace nbd
