#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "collision/base/aligned_vector.hpp"
#include "collision/bounds/affine/affine_parts.hpp"
#include "collision/bounds/affine/wide_tree.hpp"
#include "collision/geometry/embedding.hpp"
#include "collision/kernels/kernels.hpp"
#include "collision/kernels/packs.hpp"

namespace nbd {

/// What check_embedding() found: the largest number of weights of a vertex, and by how much their sum at most
/// differs from 1 plus how much of it is negative.
struct EmbeddingCheck {
    int weights = 0;
    double error = 0;
};

/// Checks that W hangs `vertex_count` vertices on nodes with these rest positions so that nodes bound
/// vertices. Throws std::invalid_argument, naming the vertex, if a weight is below -1e-5 or not finite, a
/// vertex has more than AffineModel::max_weights weights, or they do not sum to 1 within 1e-5; if W has
/// another number of rows or columns; or if a rest position is not finite.
EmbeddingCheck check_embedding(const SurfaceEmbedding& W, int vertex_count, VerticesRef rest);

/// What affine boxes know of a surface that hangs on nodes: x = W nodes with weights >= 0 that sum to 1. A
/// surface that is embedded in a tetrahedral mesh hangs so, one whose vertices are nodes (W the identity),
/// and one that follows bones. The bounds are exact: no vertex leaves its boxes, in any pose, and nothing is
/// trained.
///
/// In a pose, the nodes alone bound the parts of the surface, by affine maps that are fitted to them: see
/// Kernels::shared_map.
class AffineModel {
 public:
    static constexpr int max_weights = 32;  // of a vertex

    /// tree: of this surface. W: [vertices, nodes]. rest: rest positions of the nodes, [nodes, 3]. Throws as
    /// check_embedding().
    AffineModel(std::shared_ptr<const WideTree> tree, const SurfaceEmbedding& W, VerticesRef rest);

    const WideTree& tree() const noexcept { return *tree_; }
    const std::shared_ptr<const WideTree>& shared_tree() const noexcept { return tree_; }
    int node_count() const noexcept { return node_count_; }

    /// Bound on all rounding errors, per length: (32 + 2 K) 2^-24 + 3 e, where K and e are the
    /// numbers of check_embedding(). kernels/affine.inl proves it.
    float rounding() const noexcept { return rounding_; }

    /// The clusters, whose children are blocks, and the blocks, whose children are leaves.
    const AffineParts& clusters() const noexcept { return clusters_; }
    const AffineParts& blocks() const noexcept { return blocks_; }
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
        const auto l = static_cast<std::size_t>(leaf);
        const auto begin = static_cast<std::size_t>(weight_begin_[l]);
        return {weights_.data() + begin, weight_nodes_.data() + begin, weights_per_vertex_[l]};
    }

    /// Bytes of this model and its tree.
    std::size_t bytes() const noexcept;

 private:
    void add_leaf(std::span<const int> vertices, std::span<const int> nodes, const SurfaceEmbedding& W);

    std::shared_ptr<const WideTree> tree_;
    int node_count_ = 0;
    float rounding_ = 0;
    AffineParts clusters_, blocks_;
    std::vector<int> weight_begin_;                 // [leaves] into the two arrays below
    std::vector<std::uint8_t> weights_per_vertex_;  // [leaves]
    std::vector<float> weights_;
    std::vector<std::uint16_t> weight_nodes_;
};

}  // namespace nbd
