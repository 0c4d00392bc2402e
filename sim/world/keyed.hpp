#pragma once

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <vector>

namespace nbd {

/// A value that changes in time: linear between its keys, constant before the first and after the last.
template <class Value>
struct Keyed {
    std::vector<double> times;  // seconds, each later than the one before
    std::vector<Value> values;  // as many; none: `usual` holds throughout

    bool empty() const noexcept { return times.empty(); }

    Value at(double time, const Value& usual) const {
        if (times.empty()) return usual;
        const auto after = std::ranges::upper_bound(times, time);
        if (after == times.begin()) return values.front();
        if (after == times.end()) return values.back();
        const std::size_t k = std::distance(times.begin(), after);
        const double share = (time - times[k - 1]) / (times[k] - times[k - 1]);
        return values[k - 1] + share * (values[k] - values[k - 1]);
    }
};

}  // namespace nbd
