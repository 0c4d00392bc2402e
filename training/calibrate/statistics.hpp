#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace nbd {

/// Scores of K calibration trajectories, [K][any number >= 1], no NaN. A level is chosen from them; a score
/// above the level is a miss. Frames of one trajectory are alike, so the exchangeable units are trajectories,
/// and K of them support no more confidence than K units can [Vovk05, DunnWassermanRamdas22].
using TrajectoryScores = std::vector<std::vector<float>>;

/// The smallest level at which one trajectory's miss rate is at most `rate`, in [0, 1).
float level_at_rate(std::vector<float> scores, double rate);

/// The highest confidence that K trajectories support: K / (K + 1).
double max_confidence(std::size_t trajectories) noexcept;

/// A calibration set of K trajectories may be unlucky: then fewer fresh trajectories than asked for keep the
/// rate at the level of confident_level(). This is the share of fresh trajectories that keep it for all sets
/// but the unluckiest, which come with the probability `chance`, in (0, 0.5). The share varies from set to
/// set as Beta(k, K + 1 - k) with k = ceil((K + 1) confidence), or is better where levels have ties or
/// mean_level() is higher [Vovk05]; its mean is at least `confidence`. Throws std::invalid_argument as
/// confident_level().
double share_kept_but_for(double chance, std::size_t trajectories, double confidence);

/// The smallest level at which at least ceil((K + 1) confidence) of the K trajectories have a miss rate of at
/// most `rate`. A fresh trajectory, exchangeable with them, then has such a miss rate with a probability of
/// at least `confidence`, whatever the distribution, and at most 1 / (K + 1) more if levels have no ties. The
/// probability is over the calibration trajectories and the fresh one. Throws std::invalid_argument on a
/// confidence above max_confidence().
float confident_level(const TrajectoryScores& scores, double rate, double confidence);

/// The smallest level at which the miss rates of the K trajectories, with the largest counted twice, sum to
/// at most (K + 1) rate, as if the fresh trajectory were as bad as the worst known one. The expected miss
/// rate of a fresh trajectory is then at most rate + 1 / (K + 1), whatever the distribution, and at most
/// `rate` if no trajectory is worse than the worst of the K [AngelopoulosBates23].
float mean_level(const TrajectoryScores& scores, double rate);

/// Confidence interval of an estimated number.
struct Interval {
    double low = 0, high = 0;
};

/// Confidence interval of a probability from `successes` in `trials` >= 1 independent trials; contains it in
/// at least a share `level` of cases, whatever it is [ClopperPearson34].
Interval share_interval(int successes, int trials, double level = 0.95);

/// Confidence interval of a distribution's mean from one or more independent draws: the middle `level` of the
/// means of 2000 resamples. Approximate; too narrow if there are few draws or almost all are 0.
/// Counter-based, so the same draws and seed give the same bits.
Interval mean_interval(std::span<const double> draws, std::uint64_t seed = 0, double level = 0.95);

}  // namespace nbd
