#include "training/calibrate/interval.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "collision/base/counter_random.hpp"

namespace nbd {
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
    return {means[static_cast<std::size_t>(rest)], means[static_cast<std::size_t>(resamples - 1 - rest)]};
}

}  // namespace nbd
