#include "sim/fem/stress.hpp"

#include <Eigen/LU>
#include <cmath>

#include "meshing/parallel/parallel_for.hpp"
#include "sim/fem/polar.hpp"

namespace nbd {
namespace {

/// Edges from a tetrahedron's first corner to the others, as columns.
Eigen::Matrix3d edges(NodesRef x, const Tets& T, Eigen::Index t) {
    Eigen::Matrix3d e;
    for (int k = 0; k < 3; ++k) e.col(k) = x.row(T(t, k + 1)) - x.row(T(t, 0));
    return e;
}

}  // namespace

Eigen::VectorXd von_mises_stress(const ElasticBody& body, NodesRef x) {
    const TetMesh& rest = body.rest();
    const double mu = body.material().young / (2 * (1 + body.material().poisson));
    Eigen::VectorXd stress(rest.T.rows());
    parallel_for(static_cast<int>(rest.T.rows()), [&](int t) {
        const Eigen::Matrix3d F = edges(x, rest.T, t) * edges(rest.X, rest.T, t).inverse();
        const Eigen::Matrix3d strain = rotation_of(F).transpose() * F - Eigen::Matrix3d::Identity();
        const Eigen::Matrix3d deviator = 2 * mu * (strain - strain.trace() / 3 * Eigen::Matrix3d::Identity());
        stress[t] = std::sqrt(1.5) * deviator.norm();  // the lambda term is a pressure
    });
    return stress;
}

}  // namespace nbd
