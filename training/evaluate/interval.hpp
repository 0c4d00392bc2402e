#pragma once

#include <cstdint>
#include <span>

namespace nbd {

/// Bounds of a number that data leave uncertain.
struct Interval {
    double low = 0, high = 0;
};

/// Of a probability, from `successes` of `trials` independent ones, >= 1: holds it in at least `level` of all
/// cases, whatever it is [ClopperPearson34].
Interval share_interval(int successes, int trials, double level = 0.95);

/// Of the mean of a distribution, from independent draws, at least 1: the middle `level` of the means of 2000
/// resamples. Approximate; too narrow where the draws are few or hardly any is not 0. Counter-based, so the
/// same draws and seed give the same bits.
Interval mean_interval(std::span<const double> draws, std::uint64_t seed = 0, double level = 0.95);

}  // namespace nbd
