#include "sim/fem/stress.hpp"

#include <cmath>

#include "meshing/parallel/parallel_for.hpp"
#include "sim/fem/polar.hpp"

namespace nbd {
Eigen::VectorXd von_mises_stress(const ElasticBody& body, NodesRef x) {
    const double mu = body.material().young / (2 * (1 + body.material().poisson));
    Eigen::VectorXd stress(body.element_count());
    parallel_for(body.element_count(), [&](int t) {
        const Eigen::Matrix3d F = body.deformation_gradient(x, t);
        const Eigen::Matrix3d strain = rotation_of(F).transpose() * F - Eigen::Matrix3d::Identity();
        const Eigen::Matrix3d deviator = 2 * mu * (strain - strain.trace() / 3 * Eigen::Matrix3d::Identity());
        stress[t] = std::sqrt(1.5) * deviator.norm();  // the lambda term is a pressure
    });
    return stress;
}

}  // namespace nbd
