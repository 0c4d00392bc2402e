#pragma once

#include <functional>
#include <string>
#include <vector>

#include "apps/bench/pairs/race.hpp"
#include "apps/drawing/canvas.hpp"

namespace nbd {

struct ScalingConfig {
    std::vector<double> depths{0, 0.01, 0.02, 0.05, 0.1, 0.2, 0.4, 0.8};  // radii
    std::vector<int> bodies{2, 4, 8, 16, 32, 64, 128, 256};
    double spacing = 1.2;         // of a crowd's bodies, radii
    std::vector<int> threads{1};  // that a crowd is timed on, but for lazy boxes
    int scenes = 10;
    int cluster_faces = 512;
    std::uint64_t seed = 1;
    RaceConfig race;
};

/// A race with the second body `depth` radii further in than where the two touch.
struct DepthRow {
    double depth = 0;
    RaceRow race;
};

/// Times a crowd of so many bodies takes, medians over rounds, us.
struct CrowdRow {
    std::string method;
    int bodies = 0, threads = 1;
    double update_us = 0, query_us = 0, total_us = 0;
    long pairs = 0;
};

/// Told of each row; may throw to stop.
using ScalingProgress = std::function<void(const std::string& what)>;

/// The learned bounds that the body's tree has, its exact ones, and lazy boxes, by depth.
std::vector<DepthRow> race_by_depth(const BenchBody& coarse, const BenchBody& body,
                                    const RecordingReader& recording, std::span<const FrameId> frames,
                                    const ScalingConfig& config, const ScalingProgress& progress);

/// Likewise crowds by number of bodies and of threads. Throws std::invalid_argument, before any race, where
/// there are not so many threads.
std::vector<CrowdRow> race_crowds(const BenchBody& body, const RecordingReader& recording,
                                  std::span<const FrameId> frames, const ScalingConfig& config,
                                  const ScalingProgress& progress);

/// The least depth from which on the fastest exact method is faster than the fastest learned one at every
/// depth, in radii; infinite where it never is, or nothing was learned.
double crossover(std::span<const DepthRow> rows);

std::string to_csv(std::span<const DepthRow> rows);
std::string to_csv(std::span<const CrowdRow> rows);

/// Time by depth, by faces that intersect, and by bodies.
Page by_depth(std::span<const DepthRow> rows);
Page by_pairs(std::span<const DepthRow> rows);
Page by_bodies(std::span<const CrowdRow> rows);

}  // namespace nbd
