#pragma once

#include "collision/bounds/certified/region_motion.hpp"
#include "collision/bounds/certified/solid_graph.hpp"
#include "collision/topology/sphere_tree.hpp"

namespace nbd {

struct TetRegionConfig {
    int splits = 2;   // times that the tetrahedra under each leaf of the tree are halved, 0 to 8
    int samples = 8;  // tetrahedra whose mean gradient stands for their region's, at least 1
};

/// Groups a body's tetrahedra by the leaf of the sphere tree that is nearest to them over tetrahedra's edges,
/// then by halves along the longest side of their centroids' box. Deterministic.
/// solid: checked. Throws std::invalid_argument on a config out of range.
TetRegions tet_regions(const SphereTree& tree, const TetMesh& solid, const SurfaceWeights& W,
                       const TetRegionConfig& config = {});

}  // namespace nbd
