#pragma once

#include <functional>
#include <string>
#include <vector>

#include "training/learn/train_learned.hpp"

namespace nbd {

/// Options of the ablation of learned bounds.
struct LearnedAblationConfig {
    int depth = 7;
    std::vector<int> samples{16, 32, 48, 64, 0};  // per node; 0: as few as the tolerance needs
    int max_frames = 2000;                        // maximum per set, evenly spread; 0: all
    double miss_rate = 1e-3;                      // for calibrated margins, per node and pose
    LearnedConfig learned;
};

/// One variant at one depth; all numbers are over nodes and poses of trajectories that neither training nor
/// calibration saw.
struct LearnedAblationRow {
    std::string rule;     // see SampleRule
    std::string samples;  // requested number
    std::string fit;  // fit of the reach beyond samples: mean, quantile, linear, network, network quantile,
                      // network 32 (width 32), network relative (all relative to the largest distance)
    int depth = 0;
    double mean_samples = 0;   // per node
    double radius_error = 0;   // mean of |r - r_exact| / r_exact at margin 0
    double inflation = 0;      // mean of r / r_exact - 1 with each node's calibrated margin
    double nodes_missing = 0;  // share of nodes and poses where the sphere with margin misses a vertex
    double missing_bare = 0;   // the same at margin 0
    double box_growth = 0;     // mean growth of the samples' box, relative to the node's radius
    double box_missing = 0;    // share of nodes and poses where the grown box misses a vertex
    double nanoseconds = 0;  // per sphere, median over rounds, all nodes of the depth in turn; 0 for networks
                             // that bounds cannot have
};

/// Trains every variant on the training trajectories of the split, calibrates it on every second held-out
/// trajectory and tests it on the others. progress: called with the number of variants done and their total;
/// may be empty. Throws what train_learned() throws, and std::runtime_error if fewer than two trajectories
/// are held out.
std::vector<LearnedAblationRow> ablate_learned_bounds(const SurfaceBody& body,
                                                      const RecordingReader& recording,
                                                      const LearnedAblationConfig& config,
                                                      const std::function<void(int, int)>& progress);

/// CSV: column names, then one line per row.
std::string to_csv(const std::vector<LearnedAblationRow>& rows);

}  // namespace nbd
