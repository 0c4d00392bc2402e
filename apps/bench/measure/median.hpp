#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace nbd {

/// The value that a share of the values is below, share in [0, 1); 0 if there are no values.
inline double quantile(std::vector<double> values, double share) {
    if (values.empty()) return 0;
    const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size()));
    std::ranges::nth_element(values, at);
    return *at;
}

/// Median; the upper one of two middle values, 0 if there are no values.
inline double median(std::vector<double> values) { return quantile(std::move(values), 0.5); }

/// 0 if there are no values.
inline double mean(const std::vector<double>& values) {
    double sum = 0;
    for (const double value : values) sum += value;
    return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

}  // namespace nbd
