#pragma once

#include <functional>
#include <string>
#include <vector>

#include "apps/bench/accuracy/accuracy.hpp"
#include "training/learn/train_tree.hpp"

namespace nbd {

/// One training on the way from the paper's networks to ours.
struct NetworkStep {
    std::string network;             // "paper", "with label frame" (what was added last) ..., "default"
    double processor_seconds = 0;    // clustering, labels and networks; neither reading nor calibration
    double node_bytes = 0;           // memory of a node's network with its linear part
    int poses = 0;                   // trained on
    std::vector<Accuracy> accuracy;  // of `nbd` bounds
};

/// Trains `nbd` bounds as the paper has them (use_paper_networks()), then the default. one_by_one: between
/// the two, adds the deviations of the default one after another. progress: called with the number of steps
/// done and their total; may be empty. Throws what train_tree() and measure_accuracy() throw.
std::vector<NetworkStep> train_network_steps(const SurfaceBody& body, const RecordingReader& recording,
                                             const TrainConfig& config, bool one_by_one,
                                             const std::function<void(int, int)>& progress);

/// CSV: lines of a body for each step, set and depth, without column names.
inline constexpr std::string_view network_columns = "body,network,trained_poses,processor_seconds,node_bytes";
std::string to_csv(const std::string& body, const std::vector<NetworkStep>& steps);

}  // namespace nbd
