#pragma once

#include <span>

#include "collision/nbd_tree/nbd_networks.hpp"
#include "training/networks/mlp.hpp"

// What is done to the labels before networks are trained on them, and to the networks afterwards.
namespace nbd {

/// Fits the linear part of the nodes' centres and subtracts it from the labels. Each node's centre is fitted
/// by least squares as a linear map of the scaled modal coordinates, plus a constant that stays in the
/// labels. A small ridge covers directions that the poses hardly show.
/// z: [poses, m], scaled. spheres: [poses, 4 nodes], dc x y z and dr of every node, metres; in and out.
/// Returns the map, [m, 3 nodes]. Same bits on any number of threads.
Eigen::MatrixXf take_linear_centre(const PoseRows& z, PoseRows& spheres);

/// Rounds trained networks to bytes. Rounding shifts a network's outputs by nearly the same amount in all
/// poses, so its last biases are corrected to leave no mean error over (some of) the training poses. The
/// linear part of the centres is rounded separately, to 14 bits.
/// weights: of all nodes, see MlpShape. z: [poses, inputs], scaled. targets: [poses, 4 nodes], scaled.
/// Same bits on any number of threads.
NbdNetworks round_networks(const MlpShape& shape, std::span<const float> weights, const PoseRows& z,
                           const PoseRows& targets);

}  // namespace nbd
