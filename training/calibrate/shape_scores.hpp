#pragma once

#include <span>

#include "training/calibrate/bound_scores.hpp"

namespace nbd {

/// Scores bounds on the poses that set the shape of the calibration: limits and first margins. As
/// score_bounds(), except for `nbd` bounds: their coordinate spread was measured on these very poses, which
/// would therefore score lower than fresh poses. So each pose is scored with the spread of the others,
/// leaving out a fifth of the trajectories at a time.
BoundScores score_shape(const SurfaceBody& body, const CollisionTree& tree, BoundKind kind,
                        const RecordingReader& recording, std::span<const FrameId> frames);

}  // namespace nbd
