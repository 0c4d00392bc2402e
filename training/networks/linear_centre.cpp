#include "training/networks/linear_centre.hpp"

#include <Eigen/Cholesky>

#include "meshing/parallel/parallel_for.hpp"

namespace nbd {

Eigen::MatrixXf take_linear_centre(const PoseRows& z, PoseRows& spheres) {
    constexpr double ridge = 1e-4;  // relative to the mean variance of a coordinate
    const Eigen::Index m = z.cols(), nodes = spheres.cols() / MlpShape::outputs;
    const Eigen::MatrixXd Z = z.cast<double>();
    const Eigen::MatrixXd centred = Z.rowwise() - Z.colwise().mean();
    Eigen::MatrixXd moments = centred.transpose() * centred;
    moments.diagonal().array() += ridge * moments.trace() / static_cast<double>(m) + 1e-30;
    const Eigen::LDLT<Eigen::MatrixXd> factor(moments);

    Eigen::MatrixXf map(m, 3 * nodes);
    parallel_for(nodes, [&](int node) {
        auto centres = spheres.middleCols<3>(MlpShape::outputs * node);
        map.middleCols<3>(3 * node) =
            factor.solve(centred.transpose() * centres.cast<double>()).cast<float>();
        centres -= z * map.middleCols<3>(3 * node);
    });
    return map;
}

}  // namespace nbd
