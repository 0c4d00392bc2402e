#include "training/calibrate/statistics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>

#include "collision/base/counter_random.hpp"

namespace nbd {

float level_at_rate(std::vector<float> scores, double rate) {
    // The rate allows this many scores above the level; the next score is the level. 1e-9 makes 0.1 * 30
    // count as 3.
    const auto above = static_cast<std::ptrdiff_t>(rate * static_cast<double>(scores.size()) + 1e-9);
    std::ranges::nth_element(scores, scores.begin() + above, std::greater());
    return scores[above];
}

double max_confidence(std::size_t trajectories) noexcept {
    return static_cast<double>(trajectories) / static_cast<double>(trajectories + 1);
}

namespace {

/// Number of trajectories, of `count`, that must keep the rate; at least 1.
std::size_t rank_of(std::size_t count, double confidence) {
    const double rank = std::ceil(confidence * static_cast<double>(count + 1) - 1e-9);
    if (rank > static_cast<double>(count))
        throw std::invalid_argument(
            fmt::format("{} trajectories cannot support a confidence of {}; allowed: up to {:.4g}", count,
                        confidence, max_confidence(count)));
    return static_cast<std::size_t>(std::max(rank, 1.0));
}

}  // namespace

double share_kept_but_for(double chance, std::size_t trajectories, double confidence) {
    // The lower Clopper-Pearson limit is this quantile of Beta(k, K + 1 - k).
    return share_interval(rank_of(trajectories, confidence), trajectories, 1 - 2 * chance).low;
}

float confident_level(const TrajectoryScores& scores, double rate, double confidence) {
    const std::size_t rank = rank_of(scores.size(), confidence);
    std::vector<float> levels;
    for (const std::vector<float>& trajectory : scores) levels.push_back(level_at_rate(trajectory, rate));
    const auto nth = levels.begin() + rank - 1;
    std::ranges::nth_element(levels, nth);
    return *nth;
}

float mean_level(const TrajectoryScores& scores, double rate) {
    TrajectoryScores sorted = scores;
    std::vector<float> candidates;
    for (std::vector<float>& trajectory : sorted) {
        std::ranges::sort(trajectory, std::greater());
        candidates.insert(candidates.end(), trajectory.begin(), trajectory.end());
    }
    std::ranges::sort(candidates);
    const auto too_low = [&](float level) {
        double sum = 0, worst = 0;
        for (const std::vector<float>& trajectory : sorted) {
            const auto above =
                std::ranges::lower_bound(trajectory, level, std::greater()) - trajectory.begin();
            const double share = static_cast<double>(above) / trajectory.size();
            sum += share;
            worst = std::max(worst, share);
        }
        return sum + worst > rate * static_cast<double>(sorted.size() + 1) * (1 + 1e-9);
    };
    // At the largest score nothing misses, so at least one candidate is not too low.
    return *std::ranges::partition_point(candidates, too_low);
}

namespace {

/// Probability of at most `most` successes in `trials`.
double binomial_tail(int most, int trials, double p) {
    if (most < 0) return 0;
    if (most >= trials || p <= 0) return 1;
    if (p >= 1) return 0;
    double sum = 0;
    for (int k = 0; k <= most; ++k)
        sum += std::exp(std::lgamma(trials + 1.0) - std::lgamma(k + 1.0) - std::lgamma(trials - k + 1.0) +
                        k * std::log(p) + (trials - k) * std::log1p(-p));
    return std::min(1.0, sum);
}

/// The probability at which the decreasing function `tail` reaches `value`.
template <class Tail>
double solve(const Tail& tail, double value) {
    double low = 0, high = 1;
    for (int i = 0; i < 60; ++i) {
        const double middle = 0.5 * (low + high);
        (tail(middle) > value ? low : high) = middle;
    }
    return 0.5 * (low + high);
}

}  // namespace

Interval share_interval(int successes, int trials, double level) {
    const double rest = 0.5 * (1 - level);
    return {.low = successes == 0
                       ? 0
                       : solve([&](double p) { return binomial_tail(successes - 1, trials, p); }, 1 - rest),
            .high = successes == trials
                        ? 1
                        : solve([&](double p) { return binomial_tail(successes, trials, p); }, rest)};
}

Interval mean_interval(std::span<const double> draws, std::uint64_t seed, double level) {
    constexpr int resamples = 2000;
    const auto count = static_cast<double>(draws.size());
    std::vector<double> means;
    for (std::uint64_t r = 0; r < resamples; ++r) {
        double sum = 0;
        for (std::uint64_t i = 0; i < draws.size(); ++i)
            sum += draws[std::min(draws.size() - 1,
                                  static_cast<std::size_t>(counter_uniform(seed, r, i) * count))];
        means.push_back(sum / count);
    }
    std::ranges::sort(means);
    const double rest = 0.5 * (1 - level) * (resamples - 1);
    return {means[rest], means[resamples - 1 - rest]};
}

}  // namespace nbd
