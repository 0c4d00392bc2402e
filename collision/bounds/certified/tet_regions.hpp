#pragma once

#include "collision/bounds/certified/region_motion.hpp"
#include "collision/bounds/certified/solid_graph.hpp"
#include "collision/topology/sphere_tree.hpp"

namespace nbd {

struct TetRegionConfig {
    int splits = 2;   // number of times that the tetrahedra of each leaf are halved, 0 to 8
    int samples = 8;  // number of tetrahedra per region whose mean gradient is its G, at least 1
};

/// Groups a body's tetrahedra by the nearest leaf of the sphere tree along the edges of tetrahedra, then
/// halves each group along the longest side of its centroids' box. Deterministic. solid: valid by
/// check_solid(). Throws std::invalid_argument on a config out of range.
TetRegions tet_regions(const SphereTree& tree, const TetMesh& solid, const SurfaceWeights& W,
                       const TetRegionConfig& config = {});

}  // namespace nbd
