#include "collision/geometry/predicates.hpp"

#include <cmath>

#include "collision/geometry/expansion.hpp"

namespace nbd {
namespace {

int orient2d_exact(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) noexcept {
    const auto ux = exact_difference(b.x(), a.x()), uy = exact_difference(b.y(), a.y());
    const auto vx = exact_difference(c.x(), a.x()), vy = exact_difference(c.y(), a.y());
    return (ux * vy - uy * vx).sign();
}

}  // namespace

int orient2d(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) noexcept {
    const Eigen::Vector2d u = b - a, v = c - a;
    const double left = u.x() * v.y(), right = u.y() * v.x(), determinant = left - right;
    // Two roundings of differences, one of a product and one of the sum make a little over 4 half ulps, as in
    // PlaneSide.
    const double error = 2.5 * std::numeric_limits<double>::epsilon() * (std::abs(left) + std::abs(right));
    if (determinant > error) return 1;
    if (determinant < -error) return -1;
    return error == 0 ? 0 : orient2d_exact(a, b, c);
}

int orient3d_exact(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                   const Eigen::Vector3d& d) noexcept {
    const auto ux = exact_difference(b.x(), a.x()), vx = exact_difference(c.x(), a.x());
    const auto uy = exact_difference(b.y(), a.y()), vy = exact_difference(c.y(), a.y());
    const auto uz = exact_difference(b.z(), a.z()), vz = exact_difference(c.z(), a.z());
    const auto x = (uy * vz - uz * vy) * exact_difference(d.x(), a.x());
    const auto y = (uz * vx - ux * vz) * exact_difference(d.y(), a.y());
    const auto z = (ux * vy - uy * vx) * exact_difference(d.z(), a.z());
    return (x + y + z).sign();
}

}  // namespace nbd
