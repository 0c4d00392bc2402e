#pragma once

#include <vector>

#include "meshing/surface/edges.hpp"
#include "meshing/surface/mesh.hpp"

namespace nbd {

/// The connected components of a surface.
struct Components {
    int count = 0;
    std::vector<int> of_face;  // [faces], numbered by their first face
};

/// Turns faces (swapping their last two corners) until neighbours agree, starting from the first face of each
/// component, which keeps its own orientation. `table` is F's and stays valid for the edges, not for the
/// half-edges' numbers. Throws std::invalid_argument naming two faces where the surface has one side only.
Components make_orientations_agree(Faces& F, const EdgeTable& table);

}  // namespace nbd
