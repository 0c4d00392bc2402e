#pragma once

#include <functional>
#include <string>
#include <vector>

#include "training/learn/train_learned.hpp"

namespace nbd {

/// What the ablation of local bounds compares, and on how much.
struct LearnedAblationConfig {
    int depth = 7;
    std::vector<int> samples{16, 32, 48, 64, 0};  // of a node; 0: as few as the tolerance takes
    int max_frames = 2000;                        // of each set, evenly spread; 0: all
    double miss_rate = 1e-3;                      // that margins are calibrated for, per node and pose
    LearnedConfig learned;
};

/// One choice at one depth, all figures over nodes and poses of trajectories that neither training nor
/// calibration saw.
struct LearnedAblationRow {
    std::string rule;     // of choosing samples, see SampleRule
    std::string samples;  // asked for
    std::string fit;      // of what vertices reach beyond samples: mean, quantile, linear, network, network
                          // quantile, network 32 (of that width), network relative (everything over the
                          // largest distance)
    int depth = 0;
    double mean_samples = 0;   // of a node
    double radius_error = 0;   // mean of |r - r_exact| / r_exact at margin 0
    double inflation = 0;      // mean of r / r_exact - 1 with each node's calibrated margin
    double nodes_missing = 0;  // share of nodes and poses where the sphere misses a vertex, with the margin
    double missing_bare = 0;   // likewise at margin 0
    double box_growth = 0;     // mean growth of the samples' box over the node's radius
    double box_missing = 0;    // share of nodes and poses where the grown box misses a vertex
    double nanoseconds = 0;    // a sphere, median over rounds, all nodes of the depth in turn; 0 where bounds
                               // have no such network
};

/// Trains every choice on the training trajectories of the split, calibrates it on every second of the
/// held-out ones and tests it on the others. progress: called with the number of choices done and their
/// total; may be empty. Throws what train_learned() throws, and std::runtime_error where fewer than two
/// trajectories are held out.
std::vector<LearnedAblationRow> ablate_learned_bounds(const SurfaceBody& body,
                                                      const RecordingReader& recording,
                                                      const LearnedAblationConfig& config,
                                                      const std::function<void(int, int)>& progress);

/// One line a row under a line of column names.
std::string to_csv(const std::vector<LearnedAblationRow>& rows);

}  // namespace nbd
