#include "collision/wide_tree/wide_tree.hpp"

#include <algorithm>
#include <bit>
#include <functional>

#include "collision/geometry/divide_faces.hpp"

namespace nbd {
namespace {

/// Numbers the leaf's vertices and notes which of them are the corners of its faces.
void add_leaf(WideTree& tree, int leaf, std::span<const int> leaf_faces, FacesRef F) {
    const std::size_t l = leaf;
    tree.faces_in[l] = static_cast<std::uint8_t>(leaf_faces.size());
    std::ranges::copy(leaf_faces, tree.faces.begin() + tree_width * std::ptrdiff_t{leaf});
    const std::ptrdiff_t begin = tree.vertices.size();
    for (const int f : leaf_faces)
        for (int c = 0; c < 3; ++c) tree.vertices.push_back(F(f, c));
    std::sort(tree.vertices.begin() + begin, tree.vertices.end());
    tree.vertices.erase(std::unique(tree.vertices.begin() + begin, tree.vertices.end()), tree.vertices.end());
    for (std::size_t k = 0; k < leaf_faces.size(); ++k)
        for (int c = 0; c < 3; ++c) {
            const auto at =
                std::lower_bound(tree.vertices.begin() + begin, tree.vertices.end(), F(leaf_faces[k], c));
            tree.corners[l][static_cast<std::size_t>(tree_width * c) + k] =
                static_cast<std::uint8_t>(at - tree.vertices.begin() - begin);
        }
}

/// Largest number of faces of a cluster. A query that touches a cluster reads all its vertices once more, so
/// small surfaces, which have only a few clusters of full size, have smaller ones: above 16,384 faces 17 at
/// least. Files with learned affine bounds depend on it.
int cluster_size(std::size_t faces) noexcept {
    int size = 2 * WideTree::block_faces;
    while (size < WideTree::cluster_faces && 32 * static_cast<std::size_t>(size) < faces) size *= 2;
    return size;
}

using Part = std::function<void(std::span<int>)>;
using Divide = std::function<void(std::span<int>, int, const Part&)>;

/// Builds the tree over `all` faces. divide(faces, largest, part): divides faces into parts of at most
/// `largest`.
WideTree build(std::span<int> all, FacesRef F, int vertex_count, const Divide& divide) {
    WideTree tree;
    tree.vertex_count = vertex_count;
    tree.first_block.push_back(0);
    tree.vertex_begin.push_back(0);
    int cluster = 0;
    const auto add_block = [&](std::span<int> in_block) {
        const std::size_t first_leaf = tree.faces_in.size();
        tree.faces_in.resize(first_leaf + tree_width, 0);
        tree.faces.resize(tree.faces.size() + WideTree::block_faces, -1);
        tree.corners.resize(first_leaf + tree_width, {});
        int leaf = first_leaf;
        divide(in_block, tree_width, [&](std::span<int> in_leaf) {
            std::ranges::sort(in_leaf);
            add_leaf(tree, leaf++, in_leaf, F);
            tree.vertex_begin.push_back(tree.vertices.size());
        });
        tree.vertex_begin.resize(first_leaf + tree_width + 1, tree.vertices.size());
        tree.leaves_in.push_back(static_cast<std::uint8_t>(leaf - static_cast<int>(first_leaf)));
        tree.cluster_of.push_back(cluster);
    };
    divide(all, cluster_size(all.size()), [&](std::span<int> in_cluster) {
        divide(in_cluster, WideTree::block_faces, add_block);
        tree.first_block.push_back(tree.blocks());
        ++cluster;
    });
    return tree;
}

/// Halves these faces until no part has more than `largest`, and calls part() for each.
void halve(std::span<int> faces, int largest, const Part& part) {
    if (faces.size() <= static_cast<std::size_t>(largest)) return part(faces);
    const std::size_t middle = faces.size() / 2;
    halve(faces.first(middle), largest, part);
    halve(faces.subspan(middle), largest, part);
}

}  // namespace

std::vector<int> WideTree::block_vertices(int block) const {
    const auto first = static_cast<std::size_t>(tree_width) * static_cast<std::size_t>(block);
    std::vector<int> list(vertices.begin() + vertex_begin[first],
                          vertices.begin() + vertex_begin[first + tree_width]);
    std::ranges::sort(list);
    list.erase(std::unique(list.begin(), list.end()), list.end());
    return list;
}

WideTree::Children WideTree::cluster_children(int cluster) const {
    Children children;
    for (int k = 0; k < blocks_in(cluster); ++k) children[k] = block_vertices(first_block[cluster] + k);
    return children;
}

WideTree::Children WideTree::block_children(int block) const {
    Children children;
    for (int k = 0; k < tree_width; ++k) {
        const std::span<const int> list = leaf_vertices(tree_width * block + k);
        children[k].assign(list.begin(), list.end());
    }
    return children;
}

WideTree build_wide_tree(VerticesRef X, FacesRef F) {
    FaceDivision division(X, F);
    return build(division.faces(), F, X.rows(), [&](std::span<int> faces, int largest, const Part& part) {
        division.divide(faces, (static_cast<int>(faces.size()) + largest - 1) / largest, part);
    });
}

WideTree build_wide_tree(std::span<const int> order, FacesRef F, int vertex_count) {
    std::vector<int> faces(order.begin(), order.end());
    return build(faces, F, vertex_count, halve);
}

int most_clusters(std::size_t faces) noexcept {
    const auto size = static_cast<std::size_t>(cluster_size(faces));
    return static_cast<int>(std::bit_ceil((faces + size - 1) / size));  // halved so often, none is larger
}

bool is_over(const WideTree& tree, int vertex_count, FacesRef F) noexcept {
    if (tree.vertex_count != vertex_count) return false;
    Eigen::Index faces = 0;
    for (int leaf = 0; leaf < tree.leaves(); ++leaf)
        for (int k = 0; k < tree.faces_in[leaf]; ++k, ++faces) {
            const int face = tree.faces[tree_width * leaf + k];
            if (face >= F.rows()) return false;
            for (int c = 0; c < 3; ++c)
                if (tree.leaf_vertices(leaf)[tree.corners[leaf][tree_width * c + k]] != F(face, c))
                    return false;
        }
    return faces == F.rows();
}

void fit_wide_boxes(const WideTree& tree, VerticesRef x, WideBoxes& boxes) {
    boxes.clusters.assign(tree.clusters(), empty_box());
    boxes.blocks.assign(tree.blocks(), empty_box());
    boxes.leaves.assign(tree.leaves(), empty_box());
    for (int leaf = 0; leaf < tree.leaves(); ++leaf) {
        Box& box = boxes.leaves[leaf];
        for (const int v : tree.leaf_vertices(leaf)) {
            const Eigen::Array4f p(x(v, 0), x(v, 1), x(v, 2), 0);
            box = joined(box, {p, p});
        }
        Box& block = boxes.blocks[leaf / tree_width];
        block = joined(block, box);
    }
    for (std::size_t block = 0; block < boxes.blocks.size(); ++block) {
        Box& cluster = boxes.clusters[tree.cluster_of[block]];
        cluster = joined(cluster, boxes.blocks[block]);
    }
}

}  // namespace nbd
