#pragma once

#include <vector>

#include "meshing/surface/edges.hpp"
#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Connected components of a surface.
struct Components {
    int count = 0;
    std::vector<int> of_face;  // [faces] component of each face; components are numbered by their first face
};

/// Flips faces (swaps their last two corners) until neighbours agree. The first face of each component keeps
/// its orientation. `table` belongs to F; afterwards its edges stay valid, its half-edge numbers do not.
/// Throws std::invalid_argument naming two faces if the surface is one-sided.
Components make_orientations_agree(Faces& F, const EdgeTable& table);

}  // namespace nbd
