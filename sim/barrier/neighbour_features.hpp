#pragma once

#include <vector>

#include "sim/barrier/feature_pair.hpp"
#include "sim/patches/surface_normals.hpp"

namespace nbd {

/// The pairs of features of one surface whose owners have a vertex in common, see SurfaceTopology, but which
/// have none themselves. Queries of a surface with itself leave out such owners. surface: its number, for the
/// pairs. Sorted, without repeats.
std::vector<FeaturePair> neighbour_features(const Faces& F, const SurfaceTopology& topology, int surface);

}  // namespace nbd
