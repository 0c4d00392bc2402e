#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "training/networks/mlp_trainer.hpp"

namespace nbd {

/// Names a training by all that its result depends on: the option values and every bit of the data.
/// inputs, targets: as train_mlps() takes them.
std::string training_key(const PoseRows& inputs, const PoseRows& targets, const MlpConfig& config);

/// Writes the networks that are trained, atomically, with the key of their training. Throws
/// std::runtime_error with path and reason.
void save_checkpoint(const std::filesystem::path& path, const std::string& key,
                     const std::vector<TrainedMlp>& networks);

/// Fills in the networks that a checkpoint of the same training holds; one of another training, or none, is
/// left alone. Returns how many were filled in. Throws std::runtime_error on a damaged or foreign file.
int load_checkpoint(const std::filesystem::path& path, const std::string& key,
                    std::vector<TrainedMlp>& networks);

}  // namespace nbd
