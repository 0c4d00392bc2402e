#pragma once

#include <span>
#include <vector>

#include "collision/nbd_tree/nbd_bound.hpp"
#include "collision/tree/collision_tree.hpp"
#include "training/files/frame_source.hpp"
#include "training/networks/mlp.hpp"

namespace nbd {

/// The levels of a kind's bounds, which are numbered level after level. Of most kinds they are the depths of
/// the sphere tree.
struct BoundLevels {
    std::vector<int> begins;  // first bound of each level, then the number of bounds

    BoundLevels(const SphereTree& tree);  // NOLINT: a tree stands for its depths
    BoundLevels(const CollisionTree& tree, BoundKind kind);

    int count() const noexcept { return begins.size() - 1; }
};

/// NbdModel::z_mean and z_whitening.
struct CoordinateSpread {
    Eigen::VectorXf mean;       // [m]
    Eigen::MatrixXf whitening;  // [m, m]
};

/// Computes the scaled modal coordinates of poses, [poses, m]. Visits the frames once; same bits on any
/// number of threads.
PoseRows scaled_coordinates(FrameSource& source, std::span<const FrameId> frames, const NbdModel& model);

/// Measures where scaled modal coordinates of poses lie, from their covariance with a little ridge for
/// directions that the poses hardly show. z: at least one row, else throws std::invalid_argument.
CoordinateSpread coordinate_spread(const PoseRows& z);

/// Sets z_mean and z_whitening of the model to coordinate_spread(z).
void fit_coordinate_spread(const PoseRows& z, NbdModel& model);

/// Scores of one bound on some poses, node by node, before any margin.
struct BoundScores {
    std::vector<int> trajectories;  // [poses] ids
    /// [poses, nodes] Margin that the node needed, relative: (largest vertex distance from the centre) / r -
    /// 1; infinite if r is 0. Of `learned_affine`: in spreads or residuals.
    PoseRows excess;
    PoseRows ood_score;  // [poses, nodes] of a GatedBound; no columns for other bounds
};

/// Returns the largest distance of the listed vertices from the centre over the radius, minus 1; -1 if it is
/// 0.
float sphere_excess(VerticesRef x, std::span<const int> vertices, const Sphere& sphere);

/// Returns the trajectory id of each frame.
std::vector<int> trajectories_of(const RecordingReader& recording, std::span<const FrameId> frames);

/// Scores bounds that can miss on the frames, which are visited once. Same bits on any number of threads.
/// Throws std::invalid_argument if the tree has no such bounds.
BoundScores score_bounds(const CollisionTree& tree, BoundKind kind, FrameSource& source,
                         std::span<const FrameId> frames);

/// Scores bounds on the poses that set the shape of their margins. As score_bounds(), except for `nbd`: its
/// spread of modal coordinates comes from these same poses, which makes them look closer than fresh poses. So
/// each pose is scored with the spread of the others, leaving out a fifth of the trajectories at a time.
BoundScores score_shape(const CollisionTree& tree, BoundKind kind, FrameSource& source,
                        std::span<const FrameId> frames);

}  // namespace nbd
