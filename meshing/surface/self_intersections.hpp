#pragma once

#include <vector>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Pairs of faces of a surface that intersect beyond their shared vertices and edges, by exact tests on the
/// float32 positions. Faces that share an edge intersect if one is folded flat onto the other. Sorted, a < b.
/// mesh: closed, edge-manifold, consistently oriented, without degenerate faces (see check_surface()).
std::vector<FacePair> self_intersections(const TriMesh& mesh);

}  // namespace nbd
