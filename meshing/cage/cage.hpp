#pragma once

#include "meshing/cage/alpha_wrap.hpp"
#include "meshing/surface/mesh.hpp"

namespace nbd {

struct CageConfig {
    int nodes = 0;  // wanted number of tet nodes, >= min_cage_nodes; decides how coarse the cage is
    double offset_share = 0.25;  // distance of the cage's vertices from the soup, in alphas
};

constexpr int min_cage_nodes = 50, max_cage_nodes = 200'000;

/// How a cage fits its soup.
struct CageFit {
    double alpha = 0;     // radius of the ball that the wrap kept out, metres
    double offset = 0;    // distance of the wrap's vertices from the soup, metres
    double distance = 0;  // greatest distance of a vertex or face centre from the soup, metres
    /// A finer wrap would have lost the soup's inside through its holes, or fallen into parts. The faces are
    /// then those of a coarser wrap, divided.
    bool closes_holes = false, joins_parts = false;
};

/// A coarse closed surface around a soup.
struct Cage : CageFit {
    TriMesh surface;
};

/// Finds the wrap whose faces suit `nodes` tetrahedral nodes. One component, closed, manifold, without
/// self-intersections, oriented outward; strictly holds the soup. The same input gives the same bits.
/// Throws std::invalid_argument for a config out of range and if no cage is coarse enough.
Cage find_cage(const AlphaWrap& soup, const CageConfig& config);

/// Of what lies in `coarse` farther than `depth` from the soup, the share that `fine` leaves out, such as an
/// inside that it enters through a hole; 0 where that is less than a twentieth of the inside of `coarse`.
/// Both closed; by a grid of points.
double share_lost(const TriMesh& coarse, const TriMesh& fine, const AlphaWrap& soup, double depth);

}  // namespace nbd
