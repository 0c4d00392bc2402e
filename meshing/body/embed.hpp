#pragma once

#include "meshing/surface/mesh.hpp"

namespace nbd {

struct EmbedConfig {
    /// Rejects points outside the tetrahedra by more than rounding. All weights are then >= 0.
    bool only_inside = false;
};

/// Weights of the nodes for each point in its tetrahedron, or in the nearest one if it is outside all: its
/// barycentric coordinates, or for a quadratic tetrahedron those of TetMesh. A point exactly on a corner uses
/// only that node; a point in several tetrahedra uses the one where it lies deepest. The weights of a point
/// outside extrapolate: they magnify the deformation of that tetrahedron, more so with distance, which may be
/// half of its mean edge length at most. The points follow every affine motion of the nodes to rounding.
/// points: [n, 3]. Returns W, [n, nodes], at most four weights per row, ten in quadratic tetrahedra. Throws
/// std::invalid_argument for bad tetrahedra (index out of range, non-positive volume), a non-finite point, or
/// points too far outside (naming the first, its distance, and their number).
Embedding embed(const TetMesh& tets, NodesRef points, const EmbedConfig& config = {});

}  // namespace nbd
