#pragma once

#include <Eigen/Core>
#include <limits>
#include <vector>

namespace nbd {

/// Nodes held by a hand that moves rigidly: from `start` on it travels by `translation` and turns by
/// `rotation` about `centre`, easing in and out over `duration`, then rests; at `release` it lets go.
/// The default holds its nodes where they are: a pin.
struct Grip {
    std::vector<int> nodes{};                                  // distinct rows of the tet nodes
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();          // metres
    Eigen::Vector3d translation = Eigen::Vector3d::Zero();     // metres, in all
    Eigen::Vector3d rotation = Eigen::Vector3d::Zero();        // axis times angle in radians, in all
    double start = 0, duration = 0;                            // seconds; duration 0: at once
    double release = std::numeric_limits<double>::infinity();  // seconds
};

/// Where a node that the hand took at x0 is at `time`.
Eigen::Vector3d grip_target(const Grip& grip, const Eigen::Vector3d& x0, double time) noexcept;

/// Throws std::invalid_argument on a node outside 0 .. node_count - 1 or named twice, a number that is not
/// finite, or a negative duration.
void check_grip(const Grip& grip, int node_count);

}  // namespace nbd
