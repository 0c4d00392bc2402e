#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "collision/geometry/embedding.hpp"
#include "collision/wide_tree/affine_parts.hpp"
#include "collision/wide_tree/wide_tree.hpp"

namespace nbd {

/// What affine boxes know of a surface that hangs on nodes: x = W nodes with weights >= 0 that sum to 1. A
/// surface that is embedded in a tetrahedral mesh hangs so, one whose vertices are nodes (W the identity),
/// and one that follows bones. The bounds are exact: no vertex leaves its boxes, in any pose, and nothing is
/// trained.
///
/// In a pose, the nodes alone bound the parts of the surface, by affine maps that are fitted to them: see
/// Kernels::affine_map.
class AffineModel {
 public:
    static constexpr int max_weights = 32;         // of a vertex
    static constexpr double least_weight = -1e-5;  // what rounding may leave of 0

    /// F: the surface's faces. W: [vertices, nodes]; rows of vertices that no face uses are not checked.
    /// rest: rest positions of the nodes, [nodes, 3]. Throws std::invalid_argument, naming the vertex, if a
    /// weight is below -1e-5 or not finite, a vertex has more than max_weights weights, or they do not sum to
    /// 1 within 1e-5; if there are more than AffineParts::most_nodes nodes; if W has not vertex_count rows or
    /// not as many columns as there are nodes; if a rest position is not finite; and as build_wide_tree().
    AffineModel(FacesRef F, int vertex_count, const SurfaceEmbedding& W, VerticesRef rest);

    /// What `boxes` take: a surface whose vertices are the nodes, W the identity. No part has a map then, and
    /// nothing is rounded. Throws std::invalid_argument on more than AffineParts::most_nodes vertices.
    explicit AffineModel(WideTree tree);

    const WideTree& tree() const noexcept { return tree_; }
    int node_count() const noexcept { return node_count_; }
    /// Rest positions of the nodes as the constructor took them; empty where W is the identity by definition.
    const Vertices& rest() const noexcept { return rest_; }
    /// W as the constructor took it, without zeros and without rows of vertices that no face uses. Another
    /// model of this W and of rest() is the same.
    SurfaceEmbedding weights() const;
    /// Whether W is that of this model, apart from zeros and vertices that no face uses.
    bool hangs_by(const SurfaceEmbedding& W) const;

    /// Bound on all rounding errors, per length: 0 if every vertex is a node, else (32 + 2 K) 2^-24 + 3 e. K
    /// is the largest number of weights of a vertex; e is by how much their sum at most differs from 1, plus
    /// how much of it is negative. kernels/affine.inl proves it.
    float rounding() const noexcept { return rounding_; }

    /// The clusters, whose children are blocks, and the blocks, whose children are leaves.
    const AffineParts& clusters() const noexcept { return clusters_; }
    const AffineParts& blocks() const noexcept { return blocks_; }
    /// The nodes of each cluster.
    const NodeLists& cluster_nodes() const noexcept { return cluster_nodes_; }
    /// Number of floats that the kernels need for any part.
    int scratch() const noexcept { return 3 * std::max(clusters_.max_nodes(), blocks_.max_nodes()); }

    /// Weights of a leaf's vertices. Vertex i is the sum over k of weights[i * count + k] times the node
    /// blocks().nodes(block)[nodes[i * count + k]], in this order; entries that a vertex does not have weigh
    /// 0.
    struct LeafWeights {
        const float* weights;
        const std::uint16_t* nodes;
        int count;  // of weights per vertex
    };
    LeafWeights leaf_weights(int leaf) const noexcept {
        const std::size_t l = leaf;
        const std::size_t begin = weight_begin_[l];
        return {weights_.data() + begin, weight_nodes_.data() + begin, weights_per_vertex_[l]};
    }

    /// Bytes of this model and its tree.
    std::size_t bytes() const noexcept;

 private:
    void list_cluster_nodes();
    void add_leaf(std::span<const int> vertices, std::span<const int> nodes, const SurfaceEmbedding& W);

    WideTree tree_;
    int node_count_ = 0;
    Vertices rest_;
    float rounding_ = 0;
    AffineParts clusters_, blocks_;
    NodeLists cluster_nodes_;
    std::vector<std::uint32_t> weight_begin_;       // [leaves] into the two arrays below
    std::vector<std::uint8_t> weights_per_vertex_;  // [leaves]
    std::vector<float> weights_;
    std::vector<std::uint16_t> weight_nodes_;
};

}  // namespace nbd
