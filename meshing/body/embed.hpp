#pragma once

#include "meshing/surface/mesh.hpp"

namespace nbd {

struct EmbedConfig {
    /// How far outside the tetrahedra a point may lie, in mean edge lengths of the nearest one; >= 0, finite.
    /// Its weights extrapolate: the farther out, the more they magnify that tetrahedron's deformation.
    double max_distance = 0.5;
};

/// Barycentric weights of each point in the tetrahedron that holds it, or, outside of all, in the nearest
/// one; a point on a node takes that node alone. Every affine motion of the nodes carries the points along
/// to rounding. Where several tetrahedra hold a point, the one that it is deepest in.
/// points: [n, 3]. Returns W, [n, nodes], at most four weights a row.
/// Throws std::invalid_argument on bad tetrahedra (index out of range, volume not positive), a point that is
/// not finite, and points too far outside, naming the first with its distance, and how many there are.
Embedding embed(const TetMesh& tets, NodesRef points, const EmbedConfig& config = {});

}  // namespace nbd
