#pragma once

#include <filesystem>
#include <vector>

#include "apps/sharing/rank.hpp"
#include "training/networks/mlp_trainer.hpp"

namespace nbd {

/// A training shared by several processes. Each node's network is trained by the process that claims it and
/// kept in a file of its own until all processes have read it. Processes may join, end and be killed at any
/// time; the networks' bits do not depend on who trains them.
class SharedTraining {
 public:
    /// folder: for the networks' files; all processes must reach it. rank: of this process.
    SharedTraining(std::filesystem::path folder, const Rank& rank);

    /// Returns the complete set of networks in every process. inputs, targets, config: as in train_mlps(),
    /// the same in all processes. networks: those with weights are kept.
    /// Throws what train_mlps() throws, and std::runtime_error with path and reason.
    void train(const PoseRows& inputs, const PoseRows& targets, const MlpConfig& config,
               const TrainingHooks& hooks, std::vector<TrainedMlp>& networks) const;

    /// Marks the folder as no longer needed by this process; the last process to do so removes it.
    void leave() const;

 private:
    std::filesystem::path folder_;
    Rank rank_;
};

}  // namespace nbd
