#pragma once

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Numbers nodes along a Morton curve through their positions and tetrahedra by their first nodes, so that
/// what lies close together in space does so in memory, where steps of a simulation find it faster.
/// Tetrahedra keep their corners' order. A mesh in this order stays as it is.
void order_by_place(TetMesh& tets);

}  // namespace nbd
