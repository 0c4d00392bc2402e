#pragma once

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Edge lengths inside follow h(p) = refinement * (mean edge length at the nearest surface vertex
/// + grading * distance to it).
struct TetrahedralizeConfig {
    int nodes = 0;            // wanted number of nodes; 0: whatever `grading` gives
    double tolerance = 0.05;  // of `nodes`, allowed deviation; the search tries for a fifth of it
    double grading = 0.2;     // >= 0; ignored if `nodes` is set
};

struct TetrahedralizeResult {
    TetMesh tets;
    double grading = 0;     // what was used
    double refinement = 1;  // what was used; below 1 only where more nodes were wanted than grading 0 gives
    int runs = 0;           // how often the surface was meshed to get there
};

/// Fills a surface with tetrahedra by gmsh. The nodes start with surface.X bit for bit, the oriented boundary
/// faces are exactly surface.F, every tetrahedron is positive. Same input, same bits.
/// surface: checked (check_surface): finite, closed, manifold, oriented outward, no self-intersections.
/// Throws std::invalid_argument on a bad config or a number of nodes out of reach (with the range in reach),
/// std::runtime_error where gmsh fails.
TetrahedralizeResult tetrahedralize(const TriMesh& surface, const TetrahedralizeConfig& config = {});

}  // namespace nbd
