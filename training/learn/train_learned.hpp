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

/// Options for training learned bounds. A model's numbers are in metres, so it fits a body of that size only.
struct LearnedConfig {
    SamplesConfig samples{};
    int sample_poses = 2000;  // poses to choose samples from, evenly spread over the training poses
    bool network = false;     // false: the vertices' reach beyond the samples is a constant per node
    RadiusNetworkConfig networks{};
    double box_miss_rate = 1e-3;  // share of training poses in which a node's box may be too small
    std::uint64_t seed = 1;       // overrides the seeds in samples and networks
};

/// At most `most` of the surface's poses, evenly spread, as many as 512 MiB hold.
std::vector<Vertices> some_poses(FrameSource& source, std::span<const FrameId> frames, int most);

/// The least of the numbers that at most a share `miss_rate` of them exceeds.
float upper_quantile(Eigen::VectorXf numbers, double miss_rate);

/// Fits the growth of a box of samples so that it is too small in at most a share `miss_rate` of the poses.
/// spread, growths: of each pose. Deviations of spread^2 are at least 0.3 % of its mean, so that rounding
/// does not count as out of distribution.
BoxFit fit_box(const Eigen::VectorXf& spread, Eigen::VectorXf growths, double miss_rate);

/// Throws std::invalid_argument naming the option that is out of range.
void check_learned_config(const LearnedConfig& config);

/// Trains learned bounds. Visits the frames twice. Beside what `source` keeps, memory holds the poses from
/// which samples are chosen (at most 512 MiB) and a few numbers per pose and node. Same bits on any number of
/// threads. stage: called at the start of each stage with its name; may be empty. Throws
/// std::invalid_argument on a bad config or no frames.
LearnedModel train_learned(const SurfaceBody& body, const SphereTree& tree, FrameSource& source,
                           std::span<const FrameId> frames, const LearnedConfig& config,
                           const std::function<void(std::string_view)>& stage = {});

/// First half of train_learned(): samples and centres, with a reach of 0.
LearnedModel choose_samples(const SurfaceBody& body, const SphereTree& tree, FrameSource& source,
                            std::span<const FrameId> frames, const LearnedConfig& config);

/// Second half of train_learned(): fits the reach of all nodes to the measurements, and trains networks if
/// the config asks for them; `reach` then needs samples.
void fit_sample_reach(const SampleReach& reach, const LearnedConfig& config, LearnedModel& model);

}  // namespace nbd
