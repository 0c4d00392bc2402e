#pragma once

#include <cstdint>
#include <span>

namespace nbd {

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
