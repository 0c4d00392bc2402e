#pragma once

#include <vector>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Pairs of a surface's faces that meet where they should not, as exact tests on the float32 positions see
/// it: apart from the vertices and edges that they share, they have a point in common; two faces on a common
/// edge do where one is folded flat onto the other. Sorted, a < b.
/// mesh: closed, edge-manifold, consistently oriented, without degenerate faces (see check_surface()).
std::vector<FacePair> self_intersections(const TriMesh& mesh);

}  // namespace nbd
