#pragma once

#include <span>

#include "collision/bounds/learned/byte_networks.hpp"
#include "training/networks/mlp.hpp"

namespace nbd {

/// Networks of bytes from trained ones. Rounding moves what a network gives by much the same in all poses, so
/// its last biases are set to leave no mean error over the poses that it learned from, or some of them. (The
/// linear part of the centres, rounded to 14 bits, is apart from it.)
/// weights: of all nodes, see MlpShape. codes: [poses, inputs], scaled. targets: [poses, 4 nodes], scaled.
/// Same bits on any number of threads.
ByteNetworks round_networks(const MlpShape& shape, std::span<const float> weights, const PoseRows& z,
                            const PoseRows& targets);

}  // namespace nbd
