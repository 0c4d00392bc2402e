#pragma once

#include <span>

#include "collision/nbd_tree/nbd_networks.hpp"
#include "training/networks/mlp.hpp"

namespace nbd {

/// Rounds trained networks to bytes. Rounding shifts a network's outputs by nearly the same amount in all
/// poses, so its last biases are corrected to leave no mean error over (some of) the training poses. The
/// linear part of the centres is rounded separately, to 14 bits.
/// weights: of all nodes, see MlpShape. z: [poses, inputs], scaled. targets: [poses, 4 nodes], scaled.
/// Same bits on any number of threads.
NbdNetworks round_networks(const MlpShape& shape, std::span<const float> weights, const PoseRows& z,
                           const PoseRows& targets);

}  // namespace nbd
