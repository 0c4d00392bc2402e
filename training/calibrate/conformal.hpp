#pragma once

#include <span>
#include <vector>

namespace nbd {

/// Levels from the scores of calibration trajectories: a score above the level is a miss. Frames of one
/// trajectory are alike, so trajectories are the units that are exchangeable, and K of them promise no more
/// than K units can [Vovk05, DunnWassermanRamdas22].
using TrajectoryScores = std::vector<std::vector<float>>;  // [K][any number >= 1], none of them a NaN

/// Share of the scores above a level.
double rate_above(std::span<const float> scores, float level) noexcept;

/// The least level that one trajectory misses at a rate of at most `rate`, in [0, 1).
float level_at_rate(std::vector<float> scores, double rate);

/// The most that K trajectories can promise: K / (K + 1).
double max_confidence(std::size_t trajectories) noexcept;

/// The least level at which at least ceil((K + 1) confidence) of the K trajectories miss at a rate of at most
/// `rate`. A fresh trajectory, exchangeable with them, then does so with a probability of at least
/// `confidence`, whatever the distribution; of at most 1 / (K + 1) more where levels have no ties. The
/// probability is over the calibration trajectories and the fresh one. Throws std::invalid_argument on a
/// confidence above max_confidence().
float confident_level(const TrajectoryScores& scores, double rate, double confidence);

/// The least level at which the rates of the K trajectories, the largest counted twice, have a sum of at most
/// (K + 1) rate: as if the fresh one were as bad as the worst that is known. The expected rate of a fresh
/// trajectory is then at most rate + 1 / (K + 1), whatever the distribution, and at most `rate` where no
/// trajectory is worse than the worst of the K [AngelopoulosBates23].
float mean_level(const TrajectoryScores& scores, double rate);

}  // namespace nbd
