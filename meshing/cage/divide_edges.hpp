#pragma once

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Halves the longest edge of a surface, and its faces, until there are `vertices` vertices. The shape stays
/// the same; old vertices keep their numbers. surface: closed, edge-manifold, consistently oriented.
TriMesh divide_longest_edges(const TriMesh& surface, int vertices);

}  // namespace nbd
