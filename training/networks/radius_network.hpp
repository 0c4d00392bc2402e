#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "training/networks/mlp.hpp"

namespace nbd {

/// How the small networks of local bounds are trained: Adam, random batches, a rate that falls along a half
/// cosine to 0.
struct RadiusNetworkConfig {
    int hidden = 16;  // width of both layers: 16, which a LearnedModel takes, or 32, for comparison
    int epochs = 60;
    int batch = 128;
    double learning_rate = 5e-3;
    /// 0: squared error, so the network gives the mean. In (0, 1): pinball loss, so it gives that quantile.
    double quantile = 0;
    std::uint64_t seed = 1;
};

/// Throws std::invalid_argument naming the option that is out of range.
void check_network_config(const RadiusNetworkConfig& config);

struct TrainedRadiusNetwork {
    Eigen::VectorXf
        weights;     // W1 .. w3 as LearnedModel::values has them, then the last bias; metres in and out
    float loss = 0;  // of scaled outputs over all poses, last epoch
};

/// Trains one node's network: from distances of its samples to how far its vertices reach beyond them.
/// distances: [poses, samples], growth: [poses], metres, at least one pose; samples a multiple of 16.
/// stream: tells the random numbers of this network from others', usually the node. Same bits for the same
/// arguments.
TrainedRadiusNetwork train_radius_network(const PoseRows& distances, const Eigen::VectorXf& growth,
                                          const RadiusNetworkConfig& config, std::uint64_t stream);

/// The network of weights, applied to every row of distances: [poses].
Eigen::VectorXf apply_radius_network(const Eigen::VectorXf& weights, const PoseRows& distances);

}  // namespace nbd
