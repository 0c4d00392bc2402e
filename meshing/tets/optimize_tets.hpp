#pragma once

#include <string>

#include "meshing/surface/mesh.hpp"
#include "meshing/tets/tet_quality.hpp"

namespace nbd {

struct TetOptimization {
    int poor_before = 0, poor_after = 0;  // see poor_radius_ratio
    int nodes_added = 0;
};

/// Improves poor tetrahedra: removes edges and faces inside, moves inner nodes, and adds nodes inside where
/// that is not enough. Each change raises the least radius ratio of the tetrahedra that it touches. The
/// boundary stays bit for bit, added nodes come last, every volume stays > 0. A mesh without poor tetrahedra
/// stays as it is. The same input gives the same bits. tets: every volume > 0. max_new_nodes: nodes that may
/// be added.
TetOptimization optimize_tets(TetMesh& tets, int max_new_nodes);

/// One line for people.
std::string describe(const TetOptimization& optimization);

}  // namespace nbd
