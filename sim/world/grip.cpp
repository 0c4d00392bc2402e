#include "sim/world/grip.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace nbd {

Eigen::Vector3d grip_target(const Grip& grip, const Eigen::Vector3d& x0, double time) noexcept {
    const double past = time - grip.start;
    const double u = past <= 0 ? 0 : past >= grip.duration ? 1 : past / grip.duration;
    const double progress = u * u * (3 - 2 * u);
    const double angle = progress * grip.rotation.norm();
    const Eigen::Vector3d moved = x0 + progress * grip.translation;
    if (angle == 0) return moved;
    const Eigen::AngleAxisd turn(angle, grip.rotation.normalized());
    return grip.centre + turn * (x0 - grip.centre) + progress * grip.translation;
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
    if (!grip.centre.allFinite() || !grip.translation.allFinite() || !grip.rotation.allFinite() ||
        !std::isfinite(grip.start) || !(grip.duration >= 0) || std::isnan(grip.release))
        throw std::invalid_argument("grip: its motion needs finite numbers and a duration >= 0");
}

}  // namespace nbd
