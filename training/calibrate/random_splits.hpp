#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "training/calibrate/calibrate.hpp"

namespace nbd {

/// How often the stated miss rate held at one depth, over random splits into calibration and test.
struct RandomSplitsRow {
    int depth = 0;
    int splits = 0, calibration = 0, test = 0;  // number of splits, and trajectories in each split
    double stated = 0;         // stated share of test trajectories that keep the miss rate, mean over splits
    double keeping = 0;        // measured share, mean over splits
    double nodes_missing = 0;  // miss rate, mean over splits and test trajectories
    double highest = 0;        // highest mean miss rate of a split
};

/// Splits `pool` into equal parts for calibration and test, `splits` times at random; calibrates on the first
/// part and counts misses on the second. The training and the shape stay the same. Throws as calibrate(), and
/// std::invalid_argument if the pool has fewer than two trajectories.
std::vector<RandomSplitsRow> check_random_splits(const BoundLevels& levels, const BoundScores& shape,
                                                 const BoundScores& pool, const CalibrateConfig& config,
                                                 int splits, std::uint64_t seed = 1);

/// As above for a trained tree, with the miss rate and confidence of its calibration. source: of the training
/// recording. The pool is all trajectories that training did not see. Throws std::invalid_argument on another
/// recording.
std::vector<RandomSplitsRow> check_random_splits(const TreeFile& file, BoundKind kind, FrameSource& source,
                                                 int splits);

std::string to_text(const std::vector<RandomSplitsRow>& rows);

}  // namespace nbd
