#pragma once

#include <optional>

#include "collision/bounds/calibration.hpp"
#include "training/calibrate/bound_scores.hpp"
#include "training/files/frame_source.hpp"
#include "training/files/tree_file.hpp"

namespace nbd {

struct CalibrateConfig {
    double miss_rate = 1e-3;  // in (0, 1)
    /// In (0, 1). If empty: 0.9, or max_confidence() of fewer than nine trajectories.
    std::optional<double> confidence{};
    double out_of_range = 0.02;  // in [0, 1): share of each node's known inputs to count as out of range
    int shape_poses = 4000;      // maximum poses for the shape, evenly spread
};

/// Computes margins and limits by split-conformal calibration. The guarantee, for each depth of the tree
/// separately:
///
///   Take a fresh trajectory, exchangeable with those of `scores`. With a probability of at least
///   `confidence` over that trajectory and the calibration ones, at most a share `miss_rate` of its
///   (pose, node of that depth) pairs are misses: the node is in range, and its sphere leaves a vertex
///   outside.
///
/// A node of `learned_affine` is one of LearnedAffineModel::bounds(): it misses if any of the boxes that
/// share its margin leaves a vertex outside. The guarantee assumes nothing about the poses within a
/// trajectory, the nodes or the bound. In addition, the mean miss rate of the calibration trajectories, with
/// the worst counted twice, is at most `miss_rate`: see mean_level(). A guarantee for each single node at
/// such rates would need about 1 / miss_rate trajectories.
///
/// Method: `shape`, from other trajectories, gives each node a limit of its ood_score, which a share
/// `out_of_range` of the node's inputs in `shape` exceeds, and a first margin, which suffices in `shape` at a
/// tenth of the miss rate. Both are then constants. `scores` raise the margins of all nodes of a depth by the
/// same amount, the smallest that keeps the guarantee. Margins never fall below the first margins, even if
/// the calibration poses are mild. This leaves some reserve for poses unlike any in the data, for which
/// nothing can be guaranteed.
///
/// Throws std::invalid_argument on a config out of range, no poses, or a confidence too high for the number
/// of trajectories; std::runtime_error if a margin would be infinite.
Calibration calibrate(const BoundLevels& levels, const BoundScores& shape, const BoundScores& scores,
                      const CalibrateConfig& config);

/// Calibrates all bounds of a trained tree that can miss, replacing any earlier calibration. First measures
/// the spread of the modal coordinates on the shape's poses, for `nbd` bounds. On the recording that the tree
/// was trained on, the shape comes from the training poses and the scores from the trajectories kept for
/// calibration. On another recording of the body, each comes from half of the complete trajectories; those
/// that the tree was trained on are left out, which a notice tells, or that it cannot be checked. Throws
/// as above, and std::runtime_error if too few trajectories are left or the recording is of another body.
/// source: frames embedded with the tree's W.
void calibrate(TreeFile& file, FrameSource& source, const CalibrateConfig& config);

/// The same with a FrameSource of its own.
void calibrate(TreeFile& file, const RecordingReader& recording, const CalibrateConfig& config);

}  // namespace nbd
