#pragma once

#include <Eigen/Core>
#include <limits>
#include <vector>

namespace nbd {

/// Nodes held by a rigidly moving hand. From `start` the hand travels by `translation` and turns by
/// `rotation` about `centre`, easing in and out over `duration`, and then rests; at `release` it lets go. The
/// default is a pin: it holds its nodes in place.
struct Grip {
    std::vector<int> nodes{};                                  // distinct rows of the tet nodes
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();          // metres
    Eigen::Vector3d translation = Eigen::Vector3d::Zero();     // total, metres
    Eigen::Vector3d rotation = Eigen::Vector3d::Zero();        // total, axis times angle in radians
    double start = 0, duration = 0;                            // seconds; duration 0: immediately
    double release = std::numeric_limits<double>::infinity();  // seconds
};

/// Position at `time` of a node that the hand took at x0.
Eigen::Vector3d grip_target(const Grip& grip, const Eigen::Vector3d& x0, double time) noexcept;

/// Throws std::invalid_argument for a node outside 0 .. node_count - 1 or named twice, a non-finite number,
/// or a negative duration.
void check_grip(const Grip& grip, int node_count);

}  // namespace nbd
