#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <utility>
#include <vector>

namespace nbd {

/// A value that changes in time: linear between its keys, constant before the first and after the last.
template <class Value>
struct Keyed {
    std::vector<double> times;  // seconds, each later than the one before
    std::vector<Value> values;  // as many; none: `usual` holds throughout

    bool empty() const noexcept { return times.empty(); }

    /// Whether there is a value that `allowed` accepts for each time, and times are finite and increase.
    template <class Allowed>
    bool is_sound(const Allowed& allowed) const {
        bool is_right = times.size() == values.size() && std::ranges::all_of(values, allowed);
        for (std::size_t k = 0; is_right && k < times.size(); ++k)
            is_right = std::isfinite(times[k]) && (k == 0 || times[k] > times[k - 1]);
        return is_right;
    }

    /// Lets it go from what it is at `begin` to a value at `end`, seconds, and forgets what was told for
    /// later and long before. usual: as for at().
    void go_to(const Value& value, double begin, double end, const Value& usual) {
        constexpr std::size_t most = 6;  // keys of the last steps, which steps of second order look back to
        const Value now = at(begin, usual);
        const std::size_t kept = std::ranges::lower_bound(times, begin) - times.begin();
        times.resize(kept);
        values.resize(kept, usual);
        for (const auto& [time, key] : {std::pair(begin, now), std::pair(end, value)}) {
            times.push_back(time);
            values.push_back(key);
        }
        if (times.size() <= most) return;
        const auto old = static_cast<std::ptrdiff_t>(times.size() - most);
        times.erase(times.begin(), times.begin() + old);
        values.erase(values.begin(), values.begin() + old);
    }

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
