#pragma once

#include <optional>

#include "collision/bounds/calibration.hpp"
#include "training/calibrate/bound_scores.hpp"
#include "training/files/frame_source.hpp"
#include "training/files/tree_file.hpp"

namespace nbd {

struct CalibrateConfig {
    double miss_rate = 1e-3;  // in (0, 1)
    /// In (0, 1). Without one 0.9, or, of fewer than nine trajectories, the most that they can promise.
    std::optional<double> confidence{};
    double out_of_range = 0.02;  // in [0, 1): share of known inputs, node by node, that are too strange
    int shape_poses = 4000;      // at most, evenly spread: what is known of the nodes beforehand
};

/// Margins and limits by split-conformal calibration. The promise, for each depth of the tree on its own:
///
///   Take a fresh trajectory, exchangeable with those of `scores`. With a probability of at least
///   `confidence` over that trajectory and the calibration ones, at most a share `miss_rate` of its
///   (pose, node of that depth) pairs are misses: the node is in range, and its sphere leaves a vertex
///   outside.
///
/// No assumption is made on poses within a trajectory, on nodes, or on the bound. Beyond it, the mean rate of
/// the calibration trajectories themselves, the worst counted twice, is at most `miss_rate`: see
/// mean_level(). A promise for each node by itself at such rates would take some 1 / miss_rate trajectories.
///
/// How: `shape`, from other trajectories, gives each node a limit of its ood_score, which `out_of_range` of
/// its inputs there exceed, and a first margin, which it needed there at a tenth of the rate; from there on
/// both are constants. `scores` then lift the margins of all nodes of a depth by the same amount, the least
/// that keeps the promise, and never below the first margins: what is known to be needed is not taken back
/// because the calibration's poses happen to be mild. So limits and margins leave something for poses that
/// are like none of those, of which nothing can be stated. Throws std::invalid_argument on a config out of
/// range, no poses, more confidence than there are trajectories for, std::runtime_error where a margin would
/// be infinite.
Calibration calibrate(const SphereTree& tree, const BoundScores& shape, const BoundScores& scores,
                      const CalibrateConfig& config);

/// Which poses miss: a row a pose, a column a node, 1 or 0.
Eigen::ArrayXX<bool> misses(const Calibration& calibration, const BoundScores& scores);

/// Share of (pose, node of that depth) pairs that miss, a number a trajectory, in their order in `scores`.
std::vector<double> miss_rates(const SphereTree& tree, const Calibration& calibration,
                               const BoundScores& scores, int depth);

/// Calibrates all bounds of a trained tree that can miss; what `modal` ones know of the spread of codes is
/// measured on the shape's poses first. On the recording that it was trained on: the shape
/// from the training's poses, the promise from the trajectories kept for it. On another recording of the
/// body: each from half of the complete trajectories. Bounds that were calibrated before are calibrated anew.
/// Throws as above, and std::runtime_error where no trajectories are left or the recording is of another
/// body. source: of the tree's W.
void calibrate(TreeFile& file, FrameSource& source, const CalibrateConfig& config);

/// Likewise, with a FrameSource of its own.
void calibrate(TreeFile& file, const RecordingReader& recording, const CalibrateConfig& config);

}  // namespace nbd
