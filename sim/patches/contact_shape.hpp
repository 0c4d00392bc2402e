#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <span>
#include <vector>

#include "collision/wide_tree/wide_tree.hpp"
#include "meshing/surface/mesh.hpp"
#include "meshing/surface/shells.hpp"
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
/// vertices whose owner is among its faces, see SurfaceTopology, so each belongs to one patch. Vertices
/// without faces belong to none.
struct ContactPatches {
    static constexpr int width = tree_width;

    IndexLists vertices;  // of each patch; some patches have none
    IndexLists nodes;     // that carry the vertices of each patch's faces
    IndexLists of_block;  // likewise of each block of the tree: of `width` patches

    int count() const noexcept { return vertices.begin.size() - 1; }
};

/// What stays as it is while the surface of a body moves: x = W nodes. Bodies of one shape share it.
struct ContactShape {
    /// W: [n, N], rows sum to 1; F: faces over the n surface vertices; X: rest positions of the tet nodes,
    /// [N, 3]. Throws std::invalid_argument where shapes or indices disagree.
    ContactShape(Embedding W, Faces F, NodesRef X);

    int vertex_count() const noexcept { return W.rows(); }
    /// Whether the constructor would make the same shape of these, for a body with the same rest positions.
    bool is_of(const Embedding& other_W, const Faces& other_F) const noexcept;

    Embedding W;
    Faces F;
    SurfaceTopology topology;
    ContactPatches patches;
    bool is_much_finer = false;   // than the nodes that carry it: at least 12 vertices for each
    double overhang = 0;          // largest sum of the negative weights of a vertex, >= 0
    Eigen::VectorXd rest_areas;   // [n] m2
    double rest_diagonal = 0;     // of the box at rest, metres
    std::vector<Shell> cavities;  // at rest
};

/// The mean length of a surface's edges at rest, metres, from the areas of its faces.
double mean_edge(const ContactShape& shape) noexcept;

}  // namespace nbd
