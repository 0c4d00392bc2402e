#pragma once

#include <memory>
#include <vector>

#include "collision/tree/collision_tree.hpp"
#include "training/files/frame_stream.hpp"
#include "training/networks/mlp.hpp"

namespace nbd {

/// How one bound did on some poses, node by node, before any margin.
struct BoundScores {
    std::vector<int> trajectories;  // [poses] ids
    PoseRows excess;     // [poses, nodes] (distance of the farthest vertex from the centre) / r - 1: the
                         // relative margin that the node needed. Infinite where r is 0. Of `learned_boxes`
                         // the margin in spreads
    PoseRows ood_score;  // [poses, nodes] of a GatedBound; no columns for others
};

/// Streams the frames once. Same bits on any number of threads. Throws std::invalid_argument where the tree
/// has no such bounds.
BoundScores score_bounds(const SurfaceBody& body, const std::shared_ptr<const CollisionTree>& tree,
                         BoundKind kind, const RecordingReader& recording, std::span<const FrameId> frames);

/// The poses of some trajectories alone.
BoundScores only(const BoundScores& scores, std::span<const int> trajectories);

}  // namespace nbd
