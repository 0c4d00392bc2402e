#include "collision/bounds/affine/affine_model.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "collision/base/message.hpp"

namespace nbd {
namespace {

constexpr std::size_t most_mapped = 160;  // nodes of a cluster whose blocks are bounded by an affine map
constexpr int many_blocks = 8;      // of a cluster without a map: a kernel bounds all sixteen, present or not
constexpr double tolerance = 1e-5;  // of the weights of a vertex and of their sum

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
    std::vector<bool> is_used(static_cast<std::size_t>(vertex_count));
    for (Eigen::Index f = 0; f < F.rows(); ++f)
        for (const int v : F.row(f))
            if (v >= 0 && v < vertex_count) is_used[static_cast<std::size_t>(v)] = true;
    EmbeddingCheck checked;
    for (int v = 0; v < vertex_count; ++v) {
        if (!is_used[static_cast<std::size_t>(v)]) continue;
        int count = 0;
        double sum = 0, negative = 0;
        for (SurfaceEmbedding::InnerIterator entry(W, v); entry; ++entry) {
            if (!(entry.value() >= -tolerance))
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

std::size_t distinct_nodes(const AffineParts::Children& children, const SurfaceEmbedding& W) {
    std::vector<int> nodes;
    for (const std::vector<int>& vertices : children)
        for (const int v : vertices)
            for (SurfaceEmbedding::InnerIterator entry(W, v); entry; ++entry)
                if (entry.value() != 0) nodes.push_back(static_cast<int>(entry.col()));
    std::ranges::sort(nodes);
    return static_cast<std::size_t>(std::unique(nodes.begin(), nodes.end()) - nodes.begin());
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

/// The vertices of all children without repeats, ascending.
std::vector<int> all_of(const AffineParts::Children& children) {
    std::vector<int> vertices;
    for (const std::vector<int>& list : children) vertices.insert(vertices.end(), list.begin(), list.end());
    std::ranges::sort(vertices);
    vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
    return vertices;
}

AffineParts::ChildBounds leaf_bounds(const AffineParts::Children& leaves, const SurfaceEmbedding& W) {
    using enum AffineParts::ChildBounds;
    return are_nodes(leaves, W) ? nodes : map;
}

AffineParts::ChildBounds bounds_around_nodes(int blocks) {
    using enum AffineParts::ChildBounds;
    return blocks > many_blocks ? nodes : own_parts;
}

AffineParts::ChildBounds block_bounds(int count, const AffineParts::Children& blocks,
                                      const SurfaceEmbedding& W) {
    if (!are_nodes(blocks, W) && distinct_nodes(blocks, W) <= most_mapped)
        return AffineParts::ChildBounds::map;
    return bounds_around_nodes(count);
}

}  // namespace

AffineModel::AffineModel(FacesRef F, int vertex_count, const SurfaceEmbedding& W, VerticesRef rest)
    : node_count_(static_cast<int>(W.cols())), rest_(rest) {
    const EmbeddingCheck checked = check_embedding(F, W, vertex_count, rest);
    tree_ = build_wide_tree(embedded(W, rest), F);
    // Boxes of nodes need no rounding where every vertex is a node.
    if (checked.weights > 1 || checked.error > 0)
        rounding_ = static_cast<float>(((32 + 2 * checked.weights) * 0x1p-24 + 3 * checked.error) * 1.0001);
    for (int cluster = 0; cluster < tree_.clusters(); ++cluster) {
        for (int k = 0; k < tree_.blocks_in(cluster); ++k) {
            const int block = tree_.first_block[static_cast<std::size_t>(cluster)] + k;
            const WideTree::Children of_block = tree_.block_children(block);
            blocks_.add(of_block, leaf_bounds(of_block, W), W, rest);
            for (const std::vector<int>& vertices : of_block) add_leaf(vertices, blocks_.nodes(block), W);
        }
        const WideTree::Children of_cluster = tree_.cluster_children(cluster);
        clusters_.add(of_cluster, block_bounds(tree_.blocks_in(cluster), of_cluster, W), W, rest);
    }
    list_cluster_nodes();
}

AffineModel::AffineModel(WideTree tree) : tree_(std::move(tree)), node_count_(tree_.vertex_count) {
    for (int cluster = 0; cluster < tree_.clusters(); ++cluster) {
        for (int k = 0; k < tree_.blocks_in(cluster); ++k) {
            const int block = tree_.first_block[static_cast<std::size_t>(cluster)] + k;
            const std::vector<int> vertices = tree_.block_vertices(block);
            blocks_.add(tree_.block_children(block));
            for (int leaf = tree_width * block; leaf < tree_width * (block + 1); ++leaf) {
                weight_begin_.push_back(static_cast<int>(weights_.size()));
                weights_per_vertex_.push_back(1);
                for (const int v : tree_.leaf_vertices(leaf)) {
                    weights_.push_back(1);
                    weight_nodes_.push_back(
                        static_cast<std::uint16_t>(std::ranges::lower_bound(vertices, v) - vertices.begin()));
                }
            }
        }
        const WideTree::Children blocks = tree_.cluster_children(cluster);
        if (bounds_around_nodes(tree_.blocks_in(cluster)) == AffineParts::ChildBounds::nodes)
            clusters_.add(blocks);
        else
            clusters_.add(all_of(blocks));
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
    weight_begin_.push_back(static_cast<int>(weights_.size()));
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
    std::vector<bool> is_known(static_cast<std::size_t>(tree_.vertex_count));
    std::vector<Eigen::Triplet<float>> entries;
    for (int leaf = 0; leaf < tree_.leaves(); ++leaf) {
        const std::span<const int> vertices = tree_.leaf_vertices(leaf),
                                   nodes = blocks_.nodes(leaf / tree_width);
        const LeafWeights own = leaf_weights(leaf);
        for (std::size_t i = 0; i < vertices.size(); ++i) {
            const auto v = static_cast<std::size_t>(vertices[i]);
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
