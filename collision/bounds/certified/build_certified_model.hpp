#pragma once

#include "collision/bounds/certified/certified_model.hpp"
#include "collision/bounds/certified/solid_graph.hpp"
#include "collision/bounds/certified/tet_regions.hpp"

namespace nbd {

struct CertifiedConfig {
    int anchors = 48;  // of a node at most, 1 to 4096
    /// Anchors go where a vertex's distance from the node's centre plus this times its path to the nearest
    /// anchor is largest, >= 0: the more the body will be strained, the larger it should be.
    double spread = 4;
    TetRegionConfig regions{};
};

/// Measures a body at rest for `certified` bounds.
/// F: faces over the surface vertices that the tree is of. solid, W: the tetrahedra and the weights by which
/// the nodes carry the vertices, [n, N]; vertices may hang on nodes of several tetrahedra, or lie outside.
/// Throws std::invalid_argument on a config out of range, a bad solid, or weights that do not fit.
CertifiedModel build_certified_model(const SphereTree& tree, FacesRef F, const TetMesh& solid,
                                     const SurfaceWeights& W, const CertifiedConfig& config = {});

}  // namespace nbd
