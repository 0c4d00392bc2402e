// Worlds that seek balance, for tests.
#pragma once

#include <Eigen/Core>

#include "sim/world/world.hpp"

namespace nbd::test {

inline WorldConfig static_config(const Eigen::Vector3d& gravity = {0, 0, -9.81}, double tolerance = 1e-6) {
    return {.gravity = gravity, .statics = StaticConfig{.tolerance = tolerance}};
}

/// Increments up to the whole load. Returns the last report, or that of one that failed.
inline WorldReport load_up(World& world, int increments) {
    WorldReport report;
    for (int k = 0; k < increments && report.failure.empty(); ++k) report = world.step(1.0 / increments);
    return report;
}

/// What one side exerts on a body.
inline Eigen::Vector3d force_by(const World& world, int body, ReactionBy by, int number = 0) {
    for (const Reaction& one : world.reactions())
        if (one.body == body && one.by == by && one.number == number) return one.force;
    return Eigen::Vector3d::Zero();
}

}  // namespace nbd::test
