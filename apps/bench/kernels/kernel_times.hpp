#pragma once

#include <span>
#include <string>
#include <vector>

#include "collision/tree/collision_tree.hpp"

namespace nbd {

/// One kernel of the bounds, beside the same formula written down plainly with Eigen.
struct KernelTime {
    std::string name;
    double ours_ns = 0, plain_ns = 0;  // medians; a node, a pose for the code
    double difference = 0;             // largest, relative to the body's radius; of the code, to its length
    double max_difference = 1e-3;      // that rounding explains
    double ratio() const { return plain_ns / ours_ns; }
};

/// Times what the tree has: nodes of `local` spheres and boxes, nodes of `modal` and its code, alignment
/// included. Data is warm: `nodes` nodes, pairs of children evenly spread over the tree, again and again in
/// one pose, then the next. One thread. poses: [n, 3] each, at least one. Throws std::runtime_error where a
/// kernel and its plain form differ by more than 1e-3, modal nodes by more than 5e-3. The plain forms
/// allocate, as such code does.
std::vector<KernelTime> time_kernels(const CollisionTree& tree, std::span<const Vertices> poses, int nodes);

}  // namespace nbd
