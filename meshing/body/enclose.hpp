#pragma once

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Moves nodes of linear tetrahedra outward until all points lie within, those that do already as little as
/// may be: so that embed() has no negative weights. points: [n, 3]. Throws std::invalid_argument as embed()
/// does, where a tetrahedron would turn inside out, and where some points stay outside.
void enclose(TetMesh& tets, NodesRef points);

}  // namespace nbd
