#pragma once

#include <functional>
#include <string_view>

#include "collision/bounds/learned/learned_model.hpp"
#include "training/files/frame_source.hpp"
#include "training/files/surface_body.hpp"
#include "training/learn/sample_reach.hpp"
#include "training/learn/samples.hpp"
#include "training/networks/radius_network.hpp"

namespace nbd {

/// How local bounds are trained. Every number is in metres of the body, so a tree fits its body's size alone.
struct LearnedConfig {
    SamplesConfig samples{};
    int sample_poses = 2000;  // that samples are chosen from, evenly spread over the training poses
    bool network = false;     // else what vertices reach beyond the samples is a constant of the node
    RadiusNetworkConfig networks{};
    double box_miss_rate = 1e-3;  // share of training poses in which a node's box may be too small
    std::uint64_t seed = 1;       // overrides theirs
};

/// Throws std::invalid_argument naming the option that is out of range.
void check_learned_config(const LearnedConfig& config);

/// Trains local bounds. Visits the frames twice; beside what `source` keeps, the poses that samples are
/// chosen from (at most 512 MiB of them) and some numbers a pose and node are in memory. Same bits on any
/// number of threads. stage: called at the start of each stage with its name; may be empty. Throws
/// std::invalid_argument on a bad config or no frames.
LearnedModel train_learned(const SurfaceBody& body, const SphereTree& tree, FrameSource& source,
                           std::span<const FrameId> frames, const LearnedConfig& config,
                           const std::function<void(std::string_view)>& stage = {});

/// The first half of it: samples and centres, with a reach of 0.
LearnedModel choose_samples(const SurfaceBody& body, const SphereTree& tree, FrameSource& source,
                            std::span<const FrameId> frames, const LearnedConfig& config);

/// The second half: fits the reach of all nodes to what was measured, and trains networks if the config has
/// them; `reach` then needs samples.
void fit_sample_reach(const SampleReach& reach, const LearnedConfig& config, LearnedModel& model);

}  // namespace nbd
