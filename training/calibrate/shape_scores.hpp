#pragma once

#include <span>

#include "training/calibrate/bound_scores.hpp"

namespace nbd {

/// Scores of bounds on the poses that tell, before any promise, what is strange and what margins it takes.
/// As score_bounds(), but for `nbd` ones: these know the spread of the modal coordinates of these very poses,
/// to which each of them is less strange than a fresh pose would be. So each is scored by the spread of the
/// others, a fifth of the trajectories left out at a time.
BoundScores score_shape(VerticesRef X, const std::shared_ptr<const CollisionTree>& tree, BoundKind kind,
                        FrameSource& source, std::span<const FrameId> frames);

}  // namespace nbd
