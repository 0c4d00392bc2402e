#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "collision/bounds/box_fit.hpp"
#include "collision/geometry/positions.hpp"
#include "collision/topology/sphere_tree.hpp"

namespace nbd {

/// The trained model of learned bounds: the sphere and the box of a node from a few vertices of the node, its
/// samples. Centre: a fixed affine combination of the samples, so it follows every rigid motion without
/// alignment. Radius: the largest distance from the centre to a sample, plus a growth for the vertices in
/// between: a constant of the node or a small ReLU network of these distances, which are invariant under
/// rigid motion. Box: the box of the samples, grown by a share of their spread. The rest of the body is not
/// read.
struct LearnedModel {
    static constexpr int lanes = 16;         // samples and hidden units come in groups of this size
    static constexpr int hidden = 16;        // width of both hidden layers of a network
    static constexpr int max_samples = 128;  // per node

    struct Node {
        int sample_begin = 0, sample_count = 0;  // range of `samples`; the count is a multiple of `lanes`
        int value_begin = 0;                     // start of the node's block of `values`
        bool exact = false;  // the samples are all vertices of the node, so its sphere and box are exact
        bool operator==(const Node&) const = default;
    };
    /// How far a node's vertices reach beyond its samples, metres.
    struct Reach {
        float growth = 0;         // added to the largest distance; with a network, its last bias
        float low = 0, high = 0;  // a network's result is clamped to this range, seen in training
    };

    bool network = false;
    std::vector<Node> nodes;
    std::vector<int> samples;  // vertex indices; a node's last group is filled up with its first sample
    /// One block per node: weight of every sample in the centre [count], sum 1; mean [count] and 1 / standard
    /// deviation [count] of its squared distance from the centre in training, m^2; with a network W1 [16,
    /// count], b1, W2 [16, 16], b2, w3 [16], every matrix column-major, metres in and metres out; Reach,
    /// padded to 16.
    std::vector<float> values;
    std::vector<BoxFit> boxes;  // [nodes]; empty: no boxes were trained

    /// Number of floats in a block.
    static constexpr int block_size(int sample_count, bool network) noexcept {
        const int weights = network ? hidden * (sample_count + 1) + hidden * (hidden + 1) + hidden : 0;
        return 3 * sample_count + weights + lanes;
    }
    std::span<const int> node_samples(int node) const noexcept {
        const Node& n = nodes[static_cast<std::size_t>(node)];
        return {samples.data() + n.sample_begin, static_cast<std::size_t>(n.sample_count)};
    }
    Reach reach(int node) const noexcept {
        const Node& n = nodes[static_cast<std::size_t>(node)];
        const float* last = values.data() + n.value_begin + block_size(n.sample_count, network) - lanes;
        return {last[0], last[1], last[2]};
    }
};

struct LearnedSphere {
    Sphere sphere;        // world space
    float ood_score = 0;  // see GatedBound: largest deviation of a sample's squared distance to the centre
                          // from its mean in training, in standard deviations; 0 for exact nodes
};

/// Sphere of `node` in a pose. Contains the node's samples, and all its vertices if the node is exact. Call
/// pose.require() for the samples first.
LearnedSphere learned_sphere(const LearnedModel& model, int node, const Positions& pose) noexcept;

/// Validates a model read from a file. Throws std::invalid_argument, saying what is wrong, unless it fits a
/// tree over a surface of `vertex_count` vertices.
void check_learned_model(const LearnedModel& model, const SphereTree& tree, int vertex_count);

}  // namespace nbd
