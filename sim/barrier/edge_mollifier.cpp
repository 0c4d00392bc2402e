#include "sim/barrier/edge_mollifier.hpp"

#include <Eigen/Geometry>

namespace nbd {

double edge_mollifier(const Eigen::Vector3d& u, const Eigen::Vector3d& w, double rest_u,
                      double rest_w) noexcept {
    const double q = u.cross(w).squaredNorm() / (1e-3 * rest_u * rest_w);
    return q < 1 ? q * (2 - q) : 1;
}

}  // namespace nbd
