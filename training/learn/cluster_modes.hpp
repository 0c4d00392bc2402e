#pragma once

#include <span>

#include "collision/bounds/learned/modal_coordinates.hpp"
#include "training/files/frame_source.hpp"
#include "training/files/surface_body.hpp"
#include "training/learn/k_means.hpp"

namespace nbd {

struct ClusterModesConfig {
    KMeansConfig k_means;
    int initialisations = 4;  // runs of k-means, of which the best is kept
    int poses = 256;          // at most as many training poses, evenly spread, tell which is best
};

struct ClusteredModesChoice {
    ClusteredModes modes;
    double z_error = 0;  // mean |z - zhat| / |z| over those poses
};

/// Representatives and weights from the clusters of U's rows; of several initialisations the one with the
/// least mean |z - zhat| over training poses (section 3.4 of the paper). z is the exact code: full rigid
/// alignment, all vertices. body.U: at least one mode. Same bits on any number of threads.
/// Throws std::invalid_argument on a config out of range.
ClusteredModesChoice cluster_modes(const SurfaceBody& body, FrameSource& source,
                                   std::span<const FrameId> frames, const ClusterModesConfig& config);

}  // namespace nbd
