#pragma once

#include <span>
#include <vector>

#include "collision/bounds/learned/learned_model.hpp"
#include "training/files/frame_source.hpp"
#include "training/networks/mlp.hpp"

namespace nbd {

/// How far nodes reach beyond their samples, metres. LearnedModel::Reach is fitted to these numbers.
struct SampleReach {
    PoseRows distance;  // [poses, nodes] largest distance from the centre to a sample
    PoseRows growth;    // [poses, nodes] largest distance to any vertex of the node, minus `distance`
    PoseRows box;     // [poses, nodes] growth that the samples' box needs on its worst side, in spreads; the
                      // box's axes are random in every pose
    PoseRows spread;  // [poses, nodes] spread of the samples, see BoxFit
    PoseRows exact;   // [poses, nodes] radius of the exact sphere
    Eigen::ArrayXd squared_mean, squared_deviation;  // [samples of all nodes] mean and standard deviation of
                                                     // each sample's squared distance from its centre, m^2
    std::vector<PoseRows> samples;  // [nodes] of [poses, samples]: distances from the centre; if requested
};

/// Visits the frames once. model: whose samples and centres are given; its reach is ignored. with_samples:
/// fill SampleReach::samples. seed: of the boxes' axes. Same bits on any number of threads.
SampleReach measure_reach(const SphereTree& tree, const LearnedModel& model, FrameSource& source,
                          std::span<const FrameId> frames, std::uint64_t seed, bool with_samples);

}  // namespace nbd
