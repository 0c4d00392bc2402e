#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <limits>

namespace nbd {

/// Exact signs of orientation determinants: an evaluation in double decides if a proved error bound allows
/// it, expansion arithmetic otherwise. Products of three coordinate differences must not over- or underflow;
/// with float values converted to double they never do. Source: [Shewchuk97].

/// +1 if a, b, c turn counter-clockwise, -1 if clockwise, 0 if they are collinear.
int orient2d(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) noexcept;

/// The sign of det[b - a, c - a, d - a], by expansions alone.
int orient3d_exact(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                   const Eigen::Vector3d& d) noexcept;

/// Tells the side of the plane through a, b and c: orient3d with the part that depends on a, b and c stored.
class PlaneSide {
 public:
    PlaneSide(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) noexcept
        : a_(a), b_(b), c_(c) {
        const Eigen::Vector3d u = b - a, v = c - a, p = u.cwiseAbs(), q = v.cwiseAbs();
        normal_ = u.cross(v);
        // Each difference has an error factor 1 + e, |e| <= 2^-53; the products, their difference, the
        // product with d - a and the two sums of the determinant add at most six more such factors. So the
        // error is below ((1 + e)^8 - 1) times the permanent of the true differences. The computed permanent
        // underestimates that by at most (1 - e)^8; 9 * 2^-53 covers both. Fused operations only round less.
        constexpr double bound = 4.5 * std::numeric_limits<double>::epsilon();
        error_ = bound * Eigen::Vector3d(p.y() * q.z() + p.z() * q.y(), p.z() * q.x() + p.x() * q.z(),
                                         p.x() * q.y() + p.y() * q.x());
    }

    /// +1 if d lies on the side that (b - a) x (c - a) points to, -1 on the other side, 0 in the plane;
    /// always 0 if a, b and c are collinear.
    int operator()(const Eigen::Vector3d& d) const noexcept {
        const Eigen::Vector3d w = d - a_;
        const double determinant = normal_.dot(w), error = error_.dot(w.cwiseAbs());
        if (determinant > error) return 1;
        if (determinant < -error) return -1;
        return error == 0 ? 0 : orient3d_exact(a_, b_, c_, d);
    }

 private:
    Eigen::Vector3d a_, b_, c_, normal_, error_;
};

/// The sign of det[b - a, c - a, d - a], equal to PlaneSide(a, b, c)(d).
inline int orient3d(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                    const Eigen::Vector3d& d) noexcept {
    return PlaneSide(a, b, c)(d);
}

}  // namespace nbd
