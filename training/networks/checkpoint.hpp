#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "training/networks/mlp_trainer.hpp"

namespace nbd {

/// Hash of everything that a training's result depends on: the option values and every bit of the data.
/// inputs, targets: as train_mlps() takes them.
std::string training_key(const PoseRows& inputs, const PoseRows& targets, const MlpConfig& config);

/// Writes the networks trained so far and the key of their training, atomically. Throws std::runtime_error
/// with path and reason.
void save_checkpoint(const std::filesystem::path& path, const std::string& key,
                     const std::vector<TrainedMlp>& networks);

/// Fills in the networks stored in a checkpoint with the same key. Does nothing if the file is missing or has
/// another key. Returns the number of networks filled in. Throws std::runtime_error on a damaged or foreign
/// file.
int load_checkpoint(const std::filesystem::path& path, const std::string& key,
                    std::vector<TrainedMlp>& networks);

}  // namespace nbd
