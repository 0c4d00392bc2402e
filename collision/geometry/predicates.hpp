#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <limits>

namespace nbd {

/// Signs of orientation determinants, exact: a double evaluation where a proved error bound lets it decide,
/// expansion arithmetic where not. They need products of three coordinate differences that neither over-
/// nor underflow, which float values converted to double can never do. Source: [Shewchuk97].

/// +1 if a, b, c turn counter-clockwise, -1 if clockwise, 0 if they are collinear.
int orient2d(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) noexcept;

/// The sign of det[b - a, c - a, d - a], by expansions alone.
int orient3d_exact(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                   const Eigen::Vector3d& d) noexcept;

/// The sides of one plane: what orient3d does, with the part that depends on a, b and c kept.
class PlaneSide {
 public:
    PlaneSide(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) noexcept
        : a_(a), b_(b), c_(c) {
        const Eigen::Vector3d u = b - a, v = c - a, p = u.cwiseAbs(), q = v.cwiseAbs();
        normal_ = u.cross(v);
        // Each difference is off by a factor 1 + e, |e| <= 2^-53; the products, their difference, the product
        // with d - a and the two sums of the determinant add six such factors more at most. So the error is
        // below ((1 + e)^8 - 1) times the permanent of the true differences, which the computed permanent
        // underestimates by (1 - e)^8 at most: 9 * 2^-53 covers that. Fused operations only round less.
        constexpr double bound = 4.5 * std::numeric_limits<double>::epsilon();
        error_ = bound * Eigen::Vector3d(p.y() * q.z() + p.z() * q.y(), p.z() * q.x() + p.x() * q.z(),
                                         p.x() * q.y() + p.y() * q.x());
    }

    /// +1 where d lies on the side that (b - a) x (c - a) points to, -1 on the other, 0 in the plane; always
    /// 0 if a, b and c are collinear.
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

/// The sign of det[b - a, c - a, d - a]: as PlaneSide(a, b, c)(d).
inline int orient3d(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                    const Eigen::Vector3d& d) noexcept {
    return PlaneSide(a, b, c)(d);
}

}  // namespace nbd
