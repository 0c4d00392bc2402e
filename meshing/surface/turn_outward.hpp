#pragma once

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Makes the faces of a closed surface agree and turns its parts outward: those in a hollow of others into
/// it. Returns how many faces it turned. Leaves a surface alone that has open edges or edges of more than two
/// faces. Throws std::invalid_argument naming two faces if the surface is one-sided. mesh: finite, indices in
/// range.
int turn_outward(TriMesh& mesh);

}  // namespace nbd
