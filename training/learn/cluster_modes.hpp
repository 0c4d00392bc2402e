#pragma once

#include <span>

#include "collision/nbd_tree/modal_coordinates.hpp"
#include "training/files/frame_source.hpp"
#include "training/files/surface_body.hpp"
#include "training/learn/k_means.hpp"

namespace nbd {

struct ClusterModesConfig {
    KMeansConfig k_means;
    int initialisations = 4;  // runs of k-means; the best one is kept
    int poses = 256;          // maximum training poses, evenly spread, that decide which run is best
};

struct ClusteredModesChoice {
    ClusteredModes modes;
    double z_error = 0;  // mean |z - zhat| / |z| over the deciding poses
};

/// Chooses representatives and weights by clustering U's rows, and keeps the initialisation with the least
/// mean |z - zhat| over training poses (section 3.4 of the paper). z are the exact modal coordinates: full
/// rigid alignment, all vertices. body.U: at least one mode. Same bits on any number of threads. Throws
/// std::invalid_argument on a config out of range.
ClusteredModesChoice cluster_modes(const SurfaceBody& body, FrameSource& source,
                                   std::span<const FrameId> frames, const ClusterModesConfig& config);

}  // namespace nbd
