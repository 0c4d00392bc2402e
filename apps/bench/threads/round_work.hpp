#pragma once

#include <filesystem>
#include <functional>
#include <vector>

#include "apps/bench/threads/thread_table.hpp"
#include "meshing/body/body.hpp"
#include "training/learn/train_tree.hpp"

namespace nbd {

/// Counts the work of a round, which round(1) does on one thread, and measures it on as many threads as
/// threads_here() tells: `repeats` rounds of each, in turns. Each round must do the same work.
std::vector<MeasuredTimes> count_rounds(const std::function<void(int threads)>& round, int repeats,
                                        WorkCount& count);

/// Simulates a dataset as `nbdtree dataset` does, in a folder for temporary files, and removes it. Each
/// trajectory is a task, without the loops inside of it.
void make_dataset_round(const Body& body, int trajectories, int frames, int threads);

/// Trains and calibrates a tree as `nbdtree train` does, without writing it.
void make_training_round(const Body& body, const std::filesystem::path& recording, const TrainConfig& config);

}  // namespace nbd
