#pragma once

#include "collision/bounds/certified/certified_model.hpp"
#include "collision/bounds/certified/solid_graph.hpp"
#include "collision/bounds/certified/tet_regions.hpp"

namespace nbd {

struct CertifiedConfig {
    int anchors = 48;  // maximum number per node, 1 to 4096
    /// Each anchor is placed where a vertex's distance from the node's centre plus `spread` times its path to
    /// the nearest anchor is largest. >= 0; choose it larger for larger strains.
    double spread = 4;
    TetRegionConfig regions{};
};

/// Builds the model of `certified` bounds from a body's rest pose.
/// F: faces of the tree's surface. solid, W: the tetrahedra, and the weights by which their nodes move the
/// surface vertices, [n, N]; a vertex may depend on nodes of several tetrahedra, or lie outside. Throws
/// std::invalid_argument on a config out of range, a bad solid, or weights that do not fit.
CertifiedModel build_certified_model(const SphereTree& tree, FacesRef F, const TetMesh& solid,
                                     const SurfaceWeights& W, const CertifiedConfig& config = {});

}  // namespace nbd
