#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "training/networks/mlp.hpp"

namespace nbd {

/// Training options of the small radius networks of learned bounds: Adam, random batches, a learning rate
/// that falls along a half cosine to 0.
struct RadiusNetworkConfig {
    int hidden = 16;  // width of both layers: 16 as in LearnedModel, or 32 for comparison
    int epochs = 60;
    int batch = 128;
    double learning_rate = 5e-3;
    /// 0: squared error, the network predicts the mean. In (0, 1): pinball loss, it predicts that quantile.
    double quantile = 0;
    std::uint64_t seed = 1;
};

/// Throws std::invalid_argument naming the option that is out of range.
void check_network_config(const RadiusNetworkConfig& config);

struct TrainedRadiusNetwork {
    Eigen::VectorXf weights;  // W1 .. w3 as in LearnedModel::values, then the last bias; metres in and out
    float loss = 0;           // mean over all poses in the last epoch, scaled outputs
};

/// Trains one node's network. It maps the samples' distances to how far the node's vertices reach beyond
/// them.
/// distances: [poses, samples], growth: [poses], metres, at least one pose; samples a multiple of 16.
/// stream: selects this network's random numbers, usually the node. Same bits for the same arguments.
TrainedRadiusNetwork train_radius_network(const PoseRows& distances, const Eigen::VectorXf& growth,
                                          const RadiusNetworkConfig& config, std::uint64_t stream);

/// Applies the network with these weights to every row of distances. Returns [poses].
Eigen::VectorXf apply_radius_network(const Eigen::VectorXf& weights, const PoseRows& distances);

}  // namespace nbd
