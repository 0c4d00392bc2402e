#include "apps/view/quantise.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace nbd {

Quantised quantise(std::span<const float> numbers, int columns, int steps) {
    const std::size_t k = columns;
    if (columns < 1 || numbers.size() % k != 0 || steps < 1 || steps > 65535)
        throw std::invalid_argument(fmt::format("{} numbers in {} columns with {} steps cannot be quantised",
                                                numbers.size(), columns, steps));
    std::vector<double> high(k, -std::numeric_limits<double>::infinity());
    Quantised result{
        std::vector<double>(k, std::numeric_limits<double>::infinity()), std::vector<double>(k), {}};
    for (std::size_t i = 0; i < numbers.size(); ++i) {
        if (!std::isfinite(numbers[i]))
            throw std::invalid_argument(
                fmt::format("number {} to be shown is {}; allowed: finite numbers", i, numbers[i]));
        result.low[i % k] = std::min<double>(result.low[i % k], numbers[i]);
        high[i % k] = std::max<double>(high[i % k], numbers[i]);
    }
    for (std::size_t c = 0; c < k; ++c) {
        if (numbers.empty()) result.low[c] = high[c] = 0;
        result.step[c] = (high[c] - result.low[c]) / steps;
    }
    result.values.reserve(numbers.size());
    for (std::size_t i = 0; i < numbers.size(); ++i) {
        const double step = result.step[i % k];
        const double value = step > 0 ? std::round((numbers[i] - result.low[i % k]) / step) : 0;
        result.values.push_back(static_cast<std::uint16_t>(std::clamp<double>(value, 0, steps)));
    }
    return result;
}

}  // namespace nbd
