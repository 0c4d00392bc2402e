#pragma once

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Drops vertices that no face uses and returns their number; the others keep their order. Indices must be
/// in range.
int drop_unreferenced(TriMesh& mesh);

}  // namespace nbd
