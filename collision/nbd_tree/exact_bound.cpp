#include "collision/nbd_tree/exact_bound.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace nbd {

ExactBound::ExactBound(const SphereTree& tree)
    : tree_(&tree),
      parents_(tree.nodes.size(), -1),
      sums_(tree.nodes.size()),
      squared_(tree.nodes.size()),
      spheres_(tree.nodes.size()) {
    for (std::size_t i = 0; i < tree.nodes.size(); ++i) {
        const SphereTree::Node& node = tree.nodes[i];
        if (!node.is_leaf()) {
            parents_[node.first_child] = i;
            parents_[static_cast<std::size_t>(node.first_child) + 1] = i;
            continue;
        }
        const std::size_t begin = rows_.size() / lanes;
        const std::span<const int> vertices = tree.node_vertices(i);
        rows_.insert(rows_.end(), vertices.begin(), vertices.end());
        while (rows_.size() % lanes != 0) rows_.push_back(vertices.front());
        leaves_.push_back({static_cast<int>(i), begin, rows_.size() / lanes});
    }
    blocks_.resize(rows_.size() / lanes);
}

void ExactBound::begin_pose(VerticesRef x) noexcept {
    gather(x);
    add_up_centres();
    measure_radii();
}

void ExactBound::gather(VerticesRef x) noexcept {
    const float* positions = x.data();
    const std::ptrdiff_t stride = x.outerStride();
    for (const Leaf& leaf : leaves_) {
        const float* first = positions + stride * rows_[leaf.block_begin * lanes];
        for (std::size_t b = leaf.block_begin; b < leaf.block_end; ++b) {
            Block& block = blocks_[b];
            const int* rows = rows_.data() + b * lanes;
            for (int lane = 0; lane < lanes; ++lane) {
                const float* position = positions + stride * rows[lane];
                block.x[lane] = position[0];
                block.y[lane] = position[1];
                block.z[lane] = position[2];
            }
        }
        // A second loop, since reading whole lanes right after writing them one by one would stall. Sums of
        // offsets from the first vertex keep their digits far from the origin, and the repeated first
        // vertices of the last block add nothing.
        Lanes sum_x = Lanes::Zero(), sum_y = sum_x, sum_z = sum_x;
        for (std::size_t b = leaf.block_begin; b < leaf.block_end; ++b) {
            sum_x += blocks_[b].x - first[0];
            sum_y += blocks_[b].y - first[1];
            sum_z += blocks_[b].z - first[2];
        }
        const Eigen::Vector3d offsets(sum_x.sum(), sum_y.sum(), sum_z.sum());
        const auto count = static_cast<double>(tree_->node_vertices(leaf.node).size());
        sums_[leaf.node] = offsets + count * Eigen::Map<const Eigen::Vector3f>(first).cast<double>();
    }
}

void ExactBound::add_up_centres() noexcept {
    for (std::size_t i = tree_->nodes.size(); i-- > 0;) {
        const SphereTree::Node& node = tree_->nodes[i];
        if (!node.is_leaf()) {
            const std::size_t child = node.first_child;
            sums_[i] = sums_[child] + sums_[child + 1];
        }
        spheres_[i] = {(sums_[i] / (node.vertex_end - node.vertex_begin)).cast<float>(), 0.f};
    }
}

void ExactBound::measure_radii() noexcept {
    std::ranges::fill(squared_, Lanes::Zero());
    // Leaf by leaf, all levels at once, so that a leaf's positions are read from memory only once.
    for (const Leaf& leaf : leaves_)
        for (int node = leaf.node; node >= 0; node = parents_[node]) {
            const Eigen::Vector3f c = spheres_[node].c;
            Lanes squared = squared_[node];
            for (std::size_t b = leaf.block_begin; b < leaf.block_end; ++b) {
                const Block& block = blocks_[b];
                squared = squared.max((block.x - c.x()).square() + (block.y - c.y()).square() +
                                      (block.z - c.z()).square());
            }
            squared_[node] = squared;
        }
    // Each difference, square and sum rounds by half an ulp: 4 ulp cover them all.
    constexpr float up = 1 + 4 * std::numeric_limits<float>::epsilon();
    for (std::size_t i = 0; i < spheres_.size(); ++i) spheres_[i].r = std::sqrt(squared_[i].maxCoeff()) * up;
}

}  // namespace nbd
