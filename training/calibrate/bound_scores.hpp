#pragma once

#include <memory>
#include <vector>

#include "collision/tree/collision_tree.hpp"
#include "training/files/frame_stream.hpp"
#include "training/networks/mlp.hpp"

namespace nbd {

/// Scores of one bound on some poses, node by node, before any margin.
struct BoundScores {
    std::vector<int> trajectories;  // [poses] ids
    PoseRows excess;  // [poses, nodes] margin that the node needed, relative: (largest vertex distance from
                      // the centre) / r - 1; infinite if r is 0. Of `learned_boxes`: in spreads
    PoseRows ood_score;  // [poses, nodes] of a GatedBound; no columns for other bounds
};

/// Scores a bound on the frames, which are streamed once. Same bits on any number of threads. Throws
/// std::invalid_argument if the tree has no such bounds.
BoundScores score_bounds(const SurfaceBody& body, const std::shared_ptr<const CollisionTree>& tree,
                         BoundKind kind, const RecordingReader& recording, std::span<const FrameId> frames);

/// The scores of the given trajectories (ids) only.
BoundScores only(const BoundScores& scores, std::span<const int> trajectories);

}  // namespace nbd
