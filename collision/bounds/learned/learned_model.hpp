#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "collision/geometry/positions.hpp"
#include "collision/topology/sphere_tree.hpp"

namespace nbd {

/// Learned bounds, trained: the sphere and the box of a node from a few vertices of its own patch, its
/// samples. Centre: a fixed affine combination of them, so it follows every rigid motion without any
/// alignment. Radius: the largest distance from the centre to a sample, plus what the vertices in between
/// reach beyond: a constant of the node or a small ReLU network of these distances, which no rigid motion
/// changes. Box: that of the samples, grown by a share of
/// their spread. Nothing of the rest of the body is read.
struct LearnedModel {
    static constexpr int lanes = 16;         // samples and hidden units come in groups of so many
    static constexpr int hidden = 16;        // width of both layers of a network
    static constexpr int max_samples = 128;  // of a node

    struct Node {
        int sample_begin = 0, sample_count = 0;  // range of `samples`; the count is a multiple of `lanes`
        int value_begin = 0;                     // start of the node's block of `values`
        bool exact = false;  // the samples are all vertices of the node: its sphere and box are exact
        bool operator==(const Node&) const = default;
    };
    /// How far a node's vertices reach beyond its samples, metres.
    struct Reach {
        float growth = 0;         // added to the largest distance; with a network its last bias
        float low = 0, high = 0;  // what a network's result is kept in: the range seen in training
    };
    /// How far a node's vertices reach beyond the box of its samples. The unit is the samples' spread, the
    /// root mean square of their distances from their mean, so that a patch that stretches has more of it.
    struct BoxFit {
        float growth = 0;             // each side of the box moves outward by growth * spread
        float mean = 0;               // of spread^2 in training, m^2
        float inverse_deviation = 0;  // 1 / its standard deviation there
    };

    bool network = false;
    std::vector<Node> nodes;
    std::vector<int> samples;  // vertices; a node with fewer fills its last group with its first one
    /// Blocks: weight of every sample in the centre [count], sum 1; mean [count] and 1 / standard
    /// deviation [count] of its squared distance from the centre in training, m^2; with a network W1 [16,
    /// count], b1, W2 [16, 16], b2, w3 [16], every matrix column-major, metres in and metres out; Reach,
    /// filled up to 16.
    std::vector<float> values;
    std::vector<BoxFit> boxes;  // [nodes], or none: then there are no boxes

    /// Floats of a block.
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
    float ood_score = 0;  // see GatedBound: how far any sample's squared distance from the centre lies from
                          // its mean in training, in standard deviations; 0 for exact nodes
};

/// Sphere of `node` in a pose, whose samples have been required. Contains the node's samples, and the whole
/// node where that is exact.
LearnedSphere learned_sphere(const LearnedModel& model, int node, const Positions& pose) noexcept;

/// Throws std::invalid_argument with what is wrong unless the model fits a tree over a surface of
/// `vertex_count` vertices: for models that come from a file.
void check_learned_model(const LearnedModel& model, const SphereTree& tree, int vertex_count);

}  // namespace nbd
