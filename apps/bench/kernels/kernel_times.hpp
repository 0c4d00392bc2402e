#pragma once

#include <span>
#include <string>
#include <vector>

#include "collision/tree/collision_tree.hpp"

namespace nbd {

/// Time of one kernel of the bounds, beside the same formula in plain Eigen.
struct KernelTime {
    std::string name;
    double ours_ns = 0, plain_ns = 0;  // medians per node; per pose for modal coordinates
    double difference = 0;  // largest, relative to the body's radius; of modal coordinates, to their norm
    double max_difference = 1e-3;  // that rounding can explain
    double ratio() const { return plain_ns / ours_ns; }
};

/// Times the bounds that the tree has: nodes of learned spheres, learned boxes and nbd, and the modal
/// coordinates with alignment. Data is warm: the same `nodes` nodes, pairs of siblings evenly spread over the
/// tree, are computed repeatedly in one pose, then in the next. One thread. The plain forms allocate, as such
/// code does. poses: [n, 3] each, at least one. Throws std::runtime_error if a kernel and its plain form
/// differ by more than 1e-3, for nbd nodes 5e-3.
std::vector<KernelTime> time_kernels(const CollisionTree& tree, std::span<const Vertices> poses, int nodes);

}  // namespace nbd
