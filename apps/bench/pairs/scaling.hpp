#pragma once

#include <functional>
#include <string>
#include <vector>

#include "apps/bench/pairs/race.hpp"

namespace nbd {

struct ScalingConfig {
    std::vector<double> depths{0, 0.01, 0.02, 0.05, 0.1, 0.2, 0.4, 0.8};  // radii
    std::vector<int> bodies{2, 4, 8, 16, 32, 64, 128, 256};
    double spacing = 1.2;         // distance between bodies of a crowd, radii
    std::vector<int> threads{1};  // thread counts to time a crowd on; lazy boxes use one
    int scenes = 10;
    int cluster_faces = 512;
    std::uint64_t seed = 1;
    RaceConfig race;
};

/// A race with the second body moved in by `depth` radii after first contact.
struct DepthRow {
    double depth = 0;
    RaceRow race;
};

/// Times of a crowd of `bodies` bodies, medians over rounds, us.
struct CrowdRow {
    std::string method;
    int bodies = 0, threads = 1;
    double update_us = 0, query_us = 0, total_us = 0;
    long pairs = 0;
};

/// Called for each row; may throw to stop.
using ScalingProgress = std::function<void(const std::string& what)>;

/// Times all bounds of the body's tree and lazy boxes by depth. coarse: surface on which scenes are placed.
std::vector<DepthRow> race_by_depth(const BenchBody& coarse, const BenchBody& body,
                                    const RecordingReader& recording, std::span<const FrameId> frames,
                                    const ScalingConfig& config, const ScalingProgress& progress);

/// Times crowds by number of bodies and threads. Throws std::invalid_argument, before any timing, if there
/// are too few threads.
std::vector<CrowdRow> race_crowds(const BenchBody& body, const RecordingReader& recording,
                                  std::span<const FrameId> frames, const ScalingConfig& config,
                                  const ScalingProgress& progress);

/// The smallest depth, in radii, from which on the fastest exact method is faster than the fastest learned
/// one; infinite if there is none or there are no learned bounds.
double crossover(std::span<const DepthRow> rows);

std::string to_csv(std::span<const DepthRow> rows);
std::string to_csv(std::span<const CrowdRow> rows);

}  // namespace nbd
