#pragma once

#include <span>

#include "training/calibrate/bound_scores.hpp"

namespace nbd {

/// Scores a bound on the poses that set the shape of its margins. As score_bounds(), except for `nbd`: its
/// spread of modal coordinates comes from these same poses, which makes them look closer than fresh poses. So
/// each pose is scored with the spread of the others, leaving out a fifth of the trajectories at a time.
BoundScores score_shape(VerticesRef X, const std::shared_ptr<const CollisionTree>& tree, BoundKind kind,
                        FrameSource& source, std::span<const FrameId> frames);

}  // namespace nbd
