#include "training/networks/network_fit.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <vector>

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
    const auto fit_node = [&](int node) {
        auto centres = spheres.middleCols<3>(MlpShape::outputs * node);
        map.middleCols<3>(3 * node) =
            factor.solve(centred.transpose() * centres.cast<double>()).cast<float>();
        centres -= z * map.middleCols<3>(3 * node);
    };
    parallel_for(nodes, fit_node, 1);
    return map;
}

NbdNetworks round_networks(const MlpShape& shape, std::span<const float> weights, const PoseRows& z,
                           const PoseRows& targets) {
    const NbdNetworks rounded(shape.inputs, shape.hidden, weights);
    constexpr Eigen::Index max_poses = 1000;
    const Eigen::Index poses = std::min(z.rows(), max_poses);
    const auto pose = [&](Eigen::Index i) { return i * z.rows() / poses; };
    std::vector<FixedVector> inputs(poses, FixedVector(shape.inputs));
    for (Eigen::Index i = 0; i < poses; ++i) {
        FixedVector& x = inputs[i];
        x.numbers() = z.row(pose(i)).transpose();
        x.fix();
    }
    std::vector<float> centred(weights.begin(), weights.end());
    const auto centre_node = [&](int node) {
        Eigen::Array4d error = Eigen::Array4d::Zero();
        for (Eigen::Index i = 0; i < poses; ++i) {
            Eigen::Array4f given;
            rounded.evaluate(node, inputs[i], {&given, 1});
            const auto target = targets.row(pose(i)).segment<MlpShape::outputs>(MlpShape::outputs * node);
            error += target.transpose().array().cast<double>() - given.cast<double>();
        }
        float* bias = centred.data() + std::ptrdiff_t{node} * shape.weights() + shape.b3();
        Eigen::Map<Eigen::Array4f>{bias} += (error / static_cast<double>(poses)).cast<float>();
    };
    parallel_for(rounded.count(), centre_node, 1);
    return {shape.inputs, shape.hidden, centred};
}

}  // namespace nbd
