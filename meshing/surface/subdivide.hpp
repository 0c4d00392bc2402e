#pragma once

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// midpoint: new vertices lie halfway along edges; the shape stays the same. loop: new and old vertices are
/// averaged; repeated steps converge to a smooth surface that is slightly smaller [Loop87].
enum class SubdivisionScheme { midpoint, loop };

/// A finer surface and the matrix from coarse to fine vertices: mesh.X = S coarse.X. If W embeds the coarse
/// surface, S W embeds the fine one.
struct Subdivision {
    TriMesh mesh;
    Embedding S;  // [fine vertices, coarse vertices], rows sum to 1
};

/// Splits every face into four, `levels` times (0 to 4). Face f becomes faces 4 f (at its first corner) to 4
/// f + 3 (in the middle) with the same orientation; old vertices keep their numbers. Throws
/// std::invalid_argument for other levels and for a mesh that check_surface() rejects.
Subdivision subdivide(const TriMesh& coarse, SubdivisionScheme scheme, int levels);

/// Halves the longest edge of a surface, and its faces, until there are `vertices` vertices. The shape stays
/// the same; old vertices keep their numbers. surface: closed, edge-manifold, consistently oriented.
TriMesh divide_longest_edges(const TriMesh& surface, int vertices);

}  // namespace nbd
