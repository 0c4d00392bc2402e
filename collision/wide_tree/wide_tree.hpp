#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "collision/geometry/box.hpp"
#include "collision/geometry/geometry.hpp"

namespace nbd {

/// Children of a node of a wide tree, at most: as many as the kernels test at once.
inline constexpr int tree_width = 16;

/// A tree over the faces of a surface whose nodes have up to sixteen children. It has three levels: clusters
/// of up to 4096 faces (512 to 2048 on surfaces of up to 65,536), blocks of up to 256, and leaves of up
/// to 16. Block b has the leaves 16 b, 16 b + 1 and so on, of which only the first few may be present; slot
/// 16 l + k holds face k of leaf l. Faces are divided at medians of their centroids in the rest pose, so
/// parts are compact and nearly equal in size.
struct WideTree {
    static constexpr int block_faces = tree_width * tree_width, cluster_faces = tree_width * block_faces;
    static constexpr int max_leaf_vertices = 3 * tree_width;

    int vertex_count = 0;
    std::vector<int> first_block;         // [clusters + 1] blocks of each cluster, 1 to 16
    std::vector<int> cluster_of;          // [blocks]
    std::vector<std::uint8_t> leaves_in;  // [blocks] leaves of each block, 1 to 16
    std::vector<std::uint8_t> faces_in;   // [16 blocks] faces of each leaf; 0: not present
    std::vector<int> faces;               // [256 blocks] face in each slot; -1: none
    std::vector<int> vertices;            // of the leaves, leaf after leaf, without repeats within one
    std::vector<int> vertex_begin;        // [16 blocks + 1] range of each leaf in `vertices`
    /// [16 blocks] corner c of face k, as a position in the leaf's vertices, at [16 c + k].
    std::vector<std::array<std::uint8_t, 3 * tree_width>> corners;

    int clusters() const noexcept { return static_cast<int>(first_block.size()) - 1; }
    int blocks() const noexcept { return cluster_of.size(); }
    int blocks_in(int cluster) const noexcept {
        const std::size_t c = cluster;
        return first_block[c + 1] - first_block[c];
    }
    int leaves() const noexcept { return faces_in.size(); }
    std::span<const int> leaf_vertices(int leaf) const noexcept {
        const std::size_t l = leaf;
        return std::span(vertices).subspan(vertex_begin[l], vertex_begin[l + 1] - vertex_begin[l]);
    }
    /// Vertices of the face in a slot, as numbers of the surface.
    std::array<int, 3> face_vertices(int slot) const noexcept {
        const auto l = static_cast<std::size_t>(slot / tree_width);
        const int* at = vertices.data() + vertex_begin[l];
        const std::uint8_t* corner = corners[l].data() + slot % tree_width;
        return {at[corner[0]], at[corner[tree_width]], at[corner[2 * tree_width]]};
    }
    /// Vertices of a block without repeats, ascending.
    std::vector<int> block_vertices(int block) const;
    /// Vertices of each child of a cluster or a block; empty for children that are not present.
    using Children = std::array<std::vector<int>, tree_width>;
    Children cluster_children(int cluster) const;
    Children block_children(int block) const;
};

/// With full leaves. X: rest positions [n, 3]; F: faces [m, 3], m >= 1. Deterministic. Throws
/// std::invalid_argument on an empty surface, an index out of range, or a vertex that is not finite.
WideTree build_wide_tree(VerticesRef X, FacesRef F);

/// Without positions, with leaves that are half full at least. order: all faces, each once, not checked; best
/// in an order whose halves, quarters and so on are compact, as a sphere tree has it.
WideTree build_wide_tree(std::span<const int> order, FacesRef F, int vertex_count);

/// Number of clusters that either of these gives so many faces, at most.
int most_clusters(std::size_t faces) noexcept;

/// Whether a tree is over these faces of a surface with so many vertices.
bool is_over(const WideTree& tree, int vertex_count, FacesRef F) noexcept;

/// The exact boxes of a wide tree's nodes in a pose, from all vertices: what other bounds are measured
/// against.
struct WideBoxes {
    std::vector<Box> clusters, blocks, leaves;  // leaves that are not present have the empty box
};

/// x: [vertex_count, 3].
void fit_wide_boxes(const WideTree& tree, VerticesRef x, WideBoxes& boxes);

}  // namespace nbd
