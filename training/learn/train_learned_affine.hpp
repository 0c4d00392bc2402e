#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string_view>

#include "collision/wide_tree/learned_affine.hpp"
#include "training/files/frame_source.hpp"
#include "training/files/surface_body.hpp"

namespace nbd {

/// Options for training learned affine boxes.
struct LearnedAffineConfig {
    double box_miss_rate = 1e-3;  // share of training poses in which a box may be too small
    std::uint64_t seed = 1;
};

/// Throws std::invalid_argument naming the option that is out of range.
void check_learned_affine_config(const LearnedAffineConfig& config);

/// Trains learned affine boxes: chooses the samples of each part, far from each other at rest, and measures
/// how far clusters and children protrude from their boxes in the training poses, whose axes are turned at
/// random. Visits the frames once, or as many of them, evenly spread, as 512 MiB of measurements hold; beside
/// what `source` keeps, memory holds the poses from which samples are chosen (at most 512 MiB). Same bits on
/// any number of threads. stage: called at the start of the stage with its name; may be empty. Throws
/// std::invalid_argument on a bad config or no frames.
std::shared_ptr<const LearnedAffineModel> train_learned_affine(
    const SurfaceBody& body, const WideTree& tree, FrameSource& source, std::span<const FrameId> frames,
    const LearnedAffineConfig& config, const std::function<void(std::string_view)>& stage = {});

}  // namespace nbd
