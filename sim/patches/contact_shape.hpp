#pragma once

#include <Eigen/Core>
#include <vector>

#include "meshing/surface/mesh.hpp"
#include "sim/patches/contact_patches.hpp"
#include "sim/patches/surface_normals.hpp"

namespace nbd {

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
    double overhang = 0;           // largest sum of the negative weights of a vertex, >= 0
    Eigen::VectorXd rest_areas;    // [n] m2
    IndexLists patch_samples;      // of the vertices of each patch, those that are ContactSamples
    Eigen::VectorXd sample_areas;  // [n] m2, see ContactSamples
    double rest_diagonal = 0;      // of the box at rest, metres
};

}  // namespace nbd
