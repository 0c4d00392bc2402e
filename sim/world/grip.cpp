#include "sim/world/grip.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

namespace nbd {

bool Grip::holds(double time) const noexcept {
    constexpr double slack = 1e-9;  // seconds: times of steps are sums
    return time > take - slack && time < release - slack;
}

void check_grip(const Grip& grip, int node_count) {
    std::vector<int> sorted = grip.nodes;
    std::ranges::sort(sorted);
    if (!sorted.empty() && (sorted.front() < 0 || sorted.back() >= node_count))
        throw std::invalid_argument(fmt::format("grip: node {} is not in 0..{}",
                                                sorted.front() < 0 ? sorted.front() : sorted.back(),
                                                node_count - 1));
    if (const auto twice = std::ranges::adjacent_find(sorted); twice != sorted.end())
        throw std::invalid_argument(fmt::format("grip: node {} is named twice", *twice));
    if (!std::isfinite(grip.take) || !(grip.release >= grip.take))
        throw std::invalid_argument(
            fmt::format("grip: it takes its nodes at {} s and releases them at {} s, but must not release "
                        "them before it takes them",
                        grip.take, grip.release));
    try {
        check_motion(grip.motion);
    } catch (const std::invalid_argument& error) {
        throw std::invalid_argument(std::string("grip: ") + error.what());
    }
}

std::optional<GripsAtOdds> grips_at_odds(std::span<const Grip> grips) {
    std::vector<std::vector<int>> sorted;
    for (const Grip& grip : grips) {
        sorted.push_back(grip.nodes);
        std::ranges::sort(sorted.back());
    }
    std::vector<int> common;
    for (std::size_t b = 0; b < grips.size(); ++b)
        for (std::size_t a = 0; a < b; ++a) {
            const double from = std::max(grips[a].take, grips[b].take);
            if (!grips[a].holds(from) || !grips[b].holds(from)) continue;
            common.clear();
            std::ranges::set_intersection(sorted[a], sorted[b], std::back_inserter(common));
            if (!common.empty()) return GripsAtOdds{a, b, common.front(), from};
        }
    return std::nullopt;
}

}  // namespace nbd
