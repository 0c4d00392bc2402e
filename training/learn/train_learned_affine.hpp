#pragma once

#include <functional>
#include <memory>
#include <string_view>

#include "collision/bounds/affine/learned_affine_model.hpp"
#include "training/files/frame_source.hpp"
#include "training/files/surface_body.hpp"
#include "training/learn/train_learned.hpp"

namespace nbd {

/// Trains learned affine boxes: chooses the samples of each part, far from each other at rest, and measures
/// how far clusters and children protrude from their boxes in the training poses, whose axes are turned at
/// random. config: only box_miss_rate and seed are used. Visits the frames once, or as many of them, evenly
/// spread, as 512 MiB of measurements hold. Same bits on any number of threads. stage: as in train_learned().
/// Throws std::invalid_argument on a bad config or no frames.
std::shared_ptr<const LearnedAffineModel> train_learned_affine(
    const SurfaceBody& body, const WideTree& tree, FrameSource& source, std::span<const FrameId> frames,
    const LearnedConfig& config, const std::function<void(std::string_view)>& stage = {});

}  // namespace nbd
