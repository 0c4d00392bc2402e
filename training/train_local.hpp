#pragma once

#include <functional>
#include <string_view>

#include "collision/local_model.hpp"
#include "training/frame_stream.hpp"
#include "training/local_network.hpp"
#include "training/local_reach.hpp"
#include "training/local_samples.hpp"

namespace nbd {

/// How local bounds are trained. Every number is in metres of the body, so a tree fits its body's size alone.
struct LocalConfig {
    LocalSamplesConfig samples{};
    int sample_poses = 2000;  // that samples are chosen from, evenly spread over the training poses
    bool network = false;     // else what vertices reach beyond the samples is a constant of the node
    LocalNetworkConfig networks{};
    double box_miss_rate = 1e-3;  // share of training poses in which a node's box may be too small
    std::uint64_t seed = 1;       // overrides theirs
};

/// Throws std::invalid_argument naming the option that is out of range.
void check_local_config(const LocalConfig& config);

/// Trains local bounds. Streams the frames, twice; in memory stay the poses that samples are chosen from (at
/// most 512 MiB of them) and some numbers a pose and node. Same bits on any number of threads.
/// stage: called at the start of each stage with its name; may be empty.
/// Throws std::invalid_argument on a bad config or no frames.
LocalModel train_local(const SurfaceBody& body, const SphereTree& tree, const RecordingReader& recording,
                       std::span<const FrameId> frames, const LocalConfig& config,
                       const std::function<void(std::string_view)>& stage = {});

/// The first half of it: samples and centres, with a reach of 0.
LocalModel choose_local_samples(const SurfaceBody& body, const SphereTree& tree,
                                const RecordingReader& recording, std::span<const FrameId> frames,
                                const LocalConfig& config);

/// The second half: fits the reach of all nodes to what was measured, and trains networks if the config has
/// them; `reach` then needs samples.
void fit_local_reach(const LocalReach& reach, const LocalConfig& config, LocalModel& model);

}  // namespace nbd
