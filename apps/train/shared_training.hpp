#pragma once

#include <filesystem>
#include <vector>

#include "apps/sharing/rank.hpp"
#include "training/networks/mlp_trainer.hpp"

namespace nbd {

/// One training that several processes do together: each node's network is trained by the process that
/// claims it, and lies in a file of its own until all have read it. Processes may come, end and be killed at
/// any time; the networks have the same bits whoever trains them.
class SharedTraining {
 public:
    /// folder: where the networks lie meanwhile, reached by all. rank: which of the processes this one is.
    SharedTraining(std::filesystem::path folder, const Rank& rank);

    /// Returns once all networks are there, in every process alike. inputs, targets, config: as train_mlps()
    /// takes them, the same in all processes. networks: those that have weights are kept as they are.
    /// Throws what train_mlps() throws, and std::runtime_error with path and reason.
    void train(const PoseRows& inputs, const PoseRows& targets, const MlpConfig& config,
               const TrainingHooks& hooks, std::vector<TrainedMlp>& networks) const;

    /// Says that this process needs the folder no more; the last one that says so removes it.
    void leave() const;

 private:
    std::filesystem::path folder_;
    Rank rank_;
};

}  // namespace nbd
