#include "collision/wide_tree/affine_model.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "collision/base/message.hpp"

namespace nbd {
namespace {

constexpr std::size_t most_mapped = 160;  // nodes of a cluster whose blocks are bounded by an affine map
constexpr int many_blocks = 8;      // of a cluster without a map: a kernel bounds all sixteen, present or not
constexpr double tolerance = 1e-5;  // of the sum of a vertex's weights

void check_node_count(int count) {
    if (count > AffineParts::most_nodes)
        throw std::invalid_argument(
            message("the surface hangs on ", count, " nodes; allowed: at most ", AffineParts::most_nodes));
}

/// Where a leaf's weights begin, after so many.
std::uint32_t begin_of(std::size_t weights) {
    constexpr std::size_t most = std::numeric_limits<std::uint32_t>::max();
    if (weights > most)
        throw std::invalid_argument(message("leaves have ", weights, " weights; allowed: at most ", most));
    return weights;
}

/// What check_embedding() found.
struct EmbeddingCheck {
    int weights = 0;   // K of AffineModel::rounding()
    double error = 0;  // e
};

/// Throws as the constructor of AffineModel, which checks the faces' indices later.
EmbeddingCheck check_embedding(FacesRef F, const SurfaceEmbedding& W, int vertex_count, VerticesRef rest) {
    if (W.rows() != vertex_count)
        throw std::invalid_argument(message("the embedding has ", W.rows(),
                                            " rows; allowed: one for each of the ", vertex_count,
                                            " vertices"));
    if (W.cols() != rest.rows())
        throw std::invalid_argument(message("the embedding refers to ", W.cols(),
                                            " nodes; allowed: as many as have rest positions, ",
                                            rest.rows()));
    for (Eigen::Index i = 0; i < rest.rows(); ++i)
        if (!rest.row(i).allFinite())
            throw std::invalid_argument(message("the rest position of node ", i, " is not finite"));
    std::vector<bool> is_used(vertex_count);
    for (Eigen::Index f = 0; f < F.rows(); ++f)
        for (const int v : F.row(f))
            if (v >= 0 && v < vertex_count) is_used[v] = true;
    EmbeddingCheck checked;
    for (int v = 0; v < vertex_count; ++v) {
        if (!is_used[v]) continue;
        int count = 0;
        double sum = 0, negative = 0;
        for (SurfaceEmbedding::InnerIterator entry(W, v); entry; ++entry) {
            if (!(entry.value() >= AffineModel::least_weight))
                throw std::invalid_argument(message("vertex ", v, " has the weight ", entry.value(),
                                                    "; allowed: 0 or more, but for rounding errors"));
            sum += double{entry.value()};
            negative -= std::min(double{entry.value()}, 0.);
            count += entry.value() != 0;
        }
        if (count > AffineModel::max_weights)
            throw std::invalid_argument(message("vertex ", v, " has ", count, " weights; allowed: at most ",
                                                AffineModel::max_weights));
        if (!(std::abs(sum - 1) <= tolerance))
            throw std::invalid_argument(
                message("the weights of vertex ", v, " sum to ", sum, "; allowed: 1, within ", tolerance));
        checked.weights = std::max(checked.weights, count);
        checked.error = std::max(checked.error, std::abs(sum - 1) + negative);
    }
    return checked;
}

/// The nodes on which the vertices of each child hang, ascending.
AffineParts::Children carriers_of(const AffineParts::Children& children, const SurfaceEmbedding& W) {
    AffineParts::Children carriers;
    for (std::size_t k = 0; k < children.size(); ++k) {
        std::vector<int> nodes;
        for (const int v : children[k])
            for (SurfaceEmbedding::InnerIterator entry(W, v); entry; ++entry)
                if (entry.value() != 0) nodes.push_back(entry.col());
        carriers[k] = distinct({&nodes, 1});
    }
    return carriers;
}

/// Whether every vertex of the children is a node.
bool are_nodes(const AffineParts::Children& children, const SurfaceEmbedding& W) {
    for (const std::vector<int>& vertices : children)
        for (const int v : vertices) {
            int count = 0;
            for (SurfaceEmbedding::InnerIterator entry(W, v); entry; ++entry) count += entry.value() != 0;
            if (count > 1) return false;
        }
    return true;
}

/// How the blocks of a cluster are bounded if it has no map.
AffineParts::ChildBounds around_nodes(int blocks) {
    using enum AffineParts::ChildBounds;
    return blocks > many_blocks ? nodes : own_parts;
}

void add_block(AffineParts& parts, const AffineParts::Children& leaves, const SurfaceEmbedding& W,
               VerticesRef rest) {
    const AffineParts::Children carriers = carriers_of(leaves, W);
    if (are_nodes(leaves, W))
        parts.add_around_nodes(carriers, AffineParts::ChildBounds::nodes);
    else
        parts.add_map(leaves, carriers, W, rest);
}

void add_cluster(AffineParts& parts, int count, const AffineParts::Children& blocks,
                 const SurfaceEmbedding& W, VerticesRef rest) {
    const AffineParts::Children carriers = carriers_of(blocks, W);
    if (are_nodes(blocks, W) || distinct(carriers).size() > most_mapped)
        parts.add_around_nodes(carriers, around_nodes(count));
    else
        parts.add_map(blocks, carriers, W, rest);
}

}  // namespace

AffineModel::AffineModel(FacesRef F, int vertex_count, const SurfaceEmbedding& W, VerticesRef rest)
    : node_count_(W.cols()), rest_(rest) {
    check_node_count(node_count_);
    const EmbeddingCheck checked = check_embedding(F, W, vertex_count, rest);
    tree_ = build_wide_tree(embedded(W, rest), F);
    // Boxes of nodes need no rounding where every vertex is a node.
    if (checked.weights > 1 || checked.error > 0)
        rounding_ = static_cast<float>(((32 + 2 * checked.weights) * 0x1p-24 + 3 * checked.error) * 1.0001);
    for (int cluster = 0; cluster < tree_.clusters(); ++cluster) {
        for (int k = 0; k < tree_.blocks_in(cluster); ++k) {
            const int block = tree_.first_block[cluster] + k;
            const WideTree::Children leaves = tree_.block_children(block);
            add_block(blocks_, leaves, W, rest);
            for (const std::vector<int>& vertices : leaves) add_leaf(vertices, blocks_.nodes(block), W);
        }
        add_cluster(clusters_, tree_.blocks_in(cluster), tree_.cluster_children(cluster), W, rest);
    }
    list_cluster_nodes();
}

AffineModel::AffineModel(WideTree tree) : tree_(std::move(tree)), node_count_(tree_.vertex_count) {
    check_node_count(node_count_);
    for (int cluster = 0; cluster < tree_.clusters(); ++cluster) {
        for (int k = 0; k < tree_.blocks_in(cluster); ++k) {
            const int block = tree_.first_block[cluster] + k;
            const std::vector<int> vertices = tree_.block_vertices(block);
            blocks_.add_around_nodes(tree_.block_children(block), AffineParts::ChildBounds::nodes);
            for (int leaf = tree_width * block; leaf < tree_width * (block + 1); ++leaf) {
                weight_begin_.push_back(begin_of(weights_.size()));
                weights_per_vertex_.push_back(1);
                for (const int v : tree_.leaf_vertices(leaf)) {
                    weights_.push_back(1);
                    weight_nodes_.push_back(
                        static_cast<std::uint16_t>(std::ranges::lower_bound(vertices, v) - vertices.begin()));
                }
            }
        }
        clusters_.add_around_nodes(tree_.cluster_children(cluster), around_nodes(tree_.blocks_in(cluster)));
    }
    list_cluster_nodes();
}

void AffineModel::list_cluster_nodes() {
    std::vector<std::span<const std::int32_t>> lists;
    for (int cluster = 0; cluster < tree_.clusters(); ++cluster) lists.push_back(clusters_.nodes(cluster));
    cluster_nodes_ = NodeLists(lists, node_count_);
}

void AffineModel::add_leaf(std::span<const int> vertices, std::span<const int> nodes,
                           const SurfaceEmbedding& W) {
    int most = 0;
    for (const int v : vertices) {
        int count = 0;
        for (SurfaceEmbedding::InnerIterator entry(W, v); entry; ++entry) count += entry.value() != 0;
        most = std::max(most, count);
    }
    weight_begin_.push_back(begin_of(weights_.size()));
    weights_per_vertex_.push_back(static_cast<std::uint8_t>(most));
    for (const int v : vertices) {
        int count = 0;
        for (SurfaceEmbedding::InnerIterator entry(W, v); entry; ++entry) {
            if (entry.value() == 0) continue;
            const int place = 3 * static_cast<int>(entry.col());
            weights_.push_back(entry.value());
            weight_nodes_.push_back(
                static_cast<std::uint16_t>(std::ranges::lower_bound(nodes, place) - nodes.begin()));
            ++count;
        }
        for (; count < most; ++count) {
            weights_.push_back(0);
            weight_nodes_.push_back(weight_nodes_.back());
        }
    }
}

SurfaceEmbedding AffineModel::weights() const {
    std::vector<bool> is_known(tree_.vertex_count);
    std::vector<Eigen::Triplet<float>> entries;
    for (int leaf = 0; leaf < tree_.leaves(); ++leaf) {
        const std::span<const int> vertices = tree_.leaf_vertices(leaf),
                                   nodes = blocks_.nodes(leaf / tree_width);
        const LeafWeights own = leaf_weights(leaf);
        for (std::size_t i = 0; i < vertices.size(); ++i) {
            const std::size_t v = vertices[i];
            if (is_known[v]) continue;
            is_known[v] = true;
            for (std::size_t k = i * static_cast<std::size_t>(own.count),
                             end = k + static_cast<std::size_t>(own.count);
                 k < end; ++k)
                if (own.weights[k] != 0)
                    entries.emplace_back(vertices[i], nodes[own.nodes[k]] / 3, own.weights[k]);
        }
    }
    SurfaceEmbedding W(tree_.vertex_count, node_count_);
    W.setFromTriplets(entries.begin(), entries.end());
    return W;
}

bool AffineModel::hangs_by(const SurfaceEmbedding& W) const {
    if (W.rows() != tree_.vertex_count || W.cols() != node_count_) return false;
    const SurfaceEmbedding own = weights();
    for (int v = 0; v < tree_.vertex_count; ++v)
        if (own.row(v).nonZeros() > 0 && (own.row(v) - W.row(v)).squaredNorm() != 0) return false;
    return true;
}

std::size_t AffineModel::bytes() const noexcept {
    const auto size = [](const auto&... arrays) { return ((arrays.size() * sizeof(arrays[0])) + ...); };
    return clusters_.bytes() + blocks_.bytes() + cluster_nodes_.bytes() +
           static_cast<std::size_t>(rest_.size()) * sizeof(float) +
           size(weight_begin_, weights_per_vertex_, weights_, weight_nodes_, tree_.first_block,
                tree_.cluster_of, tree_.leaves_in, tree_.faces_in, tree_.faces, tree_.vertices,
                tree_.vertex_begin, tree_.corners);
}

}  // namespace nbd
