#pragma once

#include <memory>
#include <vector>

#include "collision/tree/collision_tree.hpp"
#include "training/files/frame_source.hpp"
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

/// Largest distance of the listed vertices from a point, divided by r, - 1; -1 where it is 0.
float sphere_excess(VerticesRef x, std::span<const int> vertices, const Sphere& sphere);

/// The trajectory's id of each frame.
std::vector<int> trajectories_of(const RecordingReader& recording, std::span<const FrameId> frames);

/// Visits the frames once. X: rest positions of the tree's surface, [n, 3]. Same bits on any number of
/// threads. Throws std::invalid_argument where the tree has no such bounds.
BoundScores score_bounds(VerticesRef X, const std::shared_ptr<const CollisionTree>& tree, BoundKind kind,
                         FrameSource& source, std::span<const FrameId> frames);

/// The poses of some trajectories alone.
BoundScores only(const BoundScores& scores, std::span<const int> trajectories);

}  // namespace nbd
