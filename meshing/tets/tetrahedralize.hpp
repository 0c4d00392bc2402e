#pragma once

#include <stdexcept>
#include <string>

#include "meshing/surface/mesh.hpp"
#include "meshing/tets/optimize_tets.hpp"

namespace nbd {

/// Edge lengths inside follow h(p) = refinement * (mean edge length at the nearest surface vertex + grading *
/// distance to that vertex).
struct TetrahedralizeConfig {
    int nodes = 0;            // desired number of nodes; 0: as `grading` gives
    double tolerance = 0.05;  // allowed relative deviation from `nodes`; the search aims for a fifth of it
    double grading = 0.2;     // >= 0; ignored if `nodes` is set
};

struct TetrahedralizeResult {
    TetMesh tets;
    double grading = 0;     // grading used
    double refinement = 1;  // refinement used; below 1 only if `nodes` exceeds what grading 0 gives
    int runs = 0;           // number of times the surface was meshed
    TetOptimization optimization = {};
};

/// The surface's own vertices leave no way to fill it with as many nodes as were asked for.
struct NodesOutOfReach : std::invalid_argument {
    NodesOutOfReach(const std::string& what, bool more) : std::invalid_argument(what), wants_more(more) {}
    bool wants_more;  // than are possible; else fewer
};

/// Fills a surface with tetrahedra by gmsh and improves the poor ones by optimize_tets(). The nodes start
/// with surface.X bit for bit, the oriented boundary faces are exactly surface.F, and every tetrahedron has
/// positive volume. The same input gives the same bits. surface: finite, closed, manifold, oriented outward,
/// no self-intersections (see check_surface()). Throws std::invalid_argument for a bad config or an
/// unreachable number of nodes (NodesOutOfReach, naming the reachable range), std::runtime_error if gmsh
/// fails.
TetrahedralizeResult tetrahedralize(const TriMesh& surface, const TetrahedralizeConfig& config = {});

}  // namespace nbd
