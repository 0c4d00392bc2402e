#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "training/calibrate/calibrate.hpp"

namespace nbd {

/// How often the promise was kept at one depth, over random splits into calibration and test.
struct RandomSplitsRow {
    int depth = 0;
    int splits = 0, calibration = 0, test = 0;  // trajectories of each split
    double stated = 0;   // share of test trajectories that must keep the miss rate, in the mean over splits
    double keeping = 0;  // and the share that did
    double nodes_missing = 0;  // mean over splits and test trajectories
    double highest = 0;        // of the splits' mean rates
};

/// Draws calibration and test trajectories anew, `splits` times, from `pool`, in equal parts; calibrates on
/// the one and counts on the other. The training, and so the shape, stay as they are. Throws as calibrate(),
/// std::invalid_argument where the pool has fewer than two trajectories.
std::vector<RandomSplitsRow> check_random_splits(const SphereTree& tree, const BoundScores& shape,
                                                 const BoundScores& pool, const CalibrateConfig& config,
                                                 int splits, std::uint64_t seed = 1);

/// The same for a trained tree and the recording of its training, with the promise of its calibration: the
/// pool is all trajectories that training did not see. Throws std::invalid_argument on another recording.
std::vector<RandomSplitsRow> check_random_splits(const TreeFile& file, BoundKind kind,
                                                 const RecordingReader& recording, int splits);

std::string to_text(const std::vector<RandomSplitsRow>& rows);

}  // namespace nbd
