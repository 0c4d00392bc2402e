#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <span>
#include <vector>

#include "collision/wide_tree/wide_tree.hpp"
#include "meshing/surface/mesh.hpp"
#include "sim/patches/surface_normals.hpp"

namespace nbd {

/// A list for each of some things, one after the other in memory.
struct IndexLists {
    std::vector<int> begin{0};  // [lists + 1]
    std::vector<int> items;

    std::span<const int> operator[](int list) const noexcept {
        const std::size_t l = list;
        return std::span(items).subspan(begin[l], begin[l + 1] - begin[l]);
    }
    /// Ends the list that items were appended to.
    void end_list() { begin.push_back(items.size()); }
    /// Likewise, and sorts it and removes what repeats.
    void end_set() {
        const auto first = items.begin() + begin.back();
        std::sort(first, items.end());
        items.erase(std::unique(first, items.end()), items.end());
        end_list();
    }
};

/// Compact parts of a surface: the leaves of a wide tree, at most sixteen faces each. A patch owns the
/// vertices and edges whose owner is among its faces, see SurfaceTopology, so each belongs to one patch.
struct ContactPatches {
    static constexpr int width = tree_width;

    IndexLists faces, vertices, edges;  // of each patch; some patches have none
    std::vector<int> of_face;           // [m] patch of each face

    ContactPatches(const WideTree& tree, const SurfaceTopology& topology);
    int count() const noexcept { return faces.begin.size() - 1; }
};

/// Vertices that make contact with other bodies for all, where a surface is much finer than the nodes that
/// carry it. Surfaces of fewer than 12 vertices for each of these nodes keep all. Of others, the vertices in
/// a cell of a grid over the rest pose that face one way keep three: the one that stands out most, then those
/// that are farthest from the ones kept. A cell is as wide as a square of the area of sixteen vertices, or of
/// a quarter of those for each node if that is more.
struct ContactSamples {
    std::vector<bool> kept;  // [n]
    Eigen::VectorXd areas;   // [n] m2: of the vertices that each one stands for; 0 unless kept
};

/// Whether a surface is much finer than the nodes that carry it, so that ContactSamples keep not all.
bool is_much_finer(Eigen::Index vertices, std::size_t carriers) noexcept;

/// rest: positions at rest, [n, 3]. rest_areas: [n] m2. carriers: number of nodes that carry the surface.
ContactSamples contact_samples(const Faces& F, const Nodes& rest, const Eigen::VectorXd& rest_areas,
                               int carriers);

/// What stays as it is while a contact surface moves. Bodies of one shape share it.
struct ContactShape {
    /// W: [n, N], rows sum to 1; F: faces over the n surface vertices; X: rest positions of the tet nodes,
    /// [N, 3]. tree: over F, its leaves become the patches; null: a tree over the rest pose. Throws
    /// std::invalid_argument where shapes or indices disagree.
    ContactShape(Embedding W, Faces F, NodesRef X, const WideTree* tree = nullptr);

    int vertex_count() const noexcept { return W.rows(); }
    /// Whether the constructor would make the same shape of these, for a body with the same rest positions.
    bool is_of(const Embedding& other_W, const Faces& other_F, const WideTree* other_tree) const noexcept;

    Embedding W;
    Faces F;
    SurfaceTopology topology;
    const WideTree* tree;  // whose leaves are the patches, or null
    ContactPatches patches;
    IndexLists patch_nodes;        // that carry the vertices of each patch's faces
    IndexLists block_nodes;        // likewise of each block of the tree: of width patches
    std::vector<int> carriers;     // nodes that carry any vertex, ascending
    bool is_much_finer = false;    // than the nodes that carry it, see ContactSamples
    double overhang = 0;           // largest sum of the negative weights of a vertex, >= 0
    Eigen::VectorXd rest_areas;    // [n] m2
    IndexLists patch_samples;      // of the vertices of each patch, those that are ContactSamples
    Eigen::VectorXd sample_areas;  // [n] m2, see ContactSamples
    double rest_diagonal = 0;      // of the box at rest, metres
};

}  // namespace nbd
