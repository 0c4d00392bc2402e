#include "sim/barrier/edge_mollifier.hpp"

#include <Eigen/Geometry>
#include <algorithm>

namespace nbd {

EdgeMollifier edge_mollifier(const Eigen::Vector3d& u, const Eigen::Vector3d& w, double rest_u,
                             double rest_w) noexcept {
    const double end = 1e-3 * rest_u * rest_w, q = u.cross(w).squaredNorm() / end;
    if (!(q < 1)) return {};
    const double by_q = 2 - 2 * q, by_q_twice = -2, u_u = u.squaredNorm(), w_w = w.squaredNorm();
    const Eigen::Vector3d q_by_u = 2 / end * w.cross(u.cross(w)), q_by_w = 2 / end * u.cross(w.cross(u));
    return {.value = q * (2 - q),
            .by_u = by_q * q_by_u,
            .by_w = by_q * q_by_w,
            .curvature_u = std::max(2 / end * w_w * by_q + by_q_twice * q_by_u.squaredNorm(), 0.0),
            .curvature_w = std::max(2 / end * u_u * by_q + by_q_twice * q_by_w.squaredNorm(), 0.0)};
}

}  // namespace nbd
