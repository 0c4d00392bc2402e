#pragma once

#include <Eigen/Core>
#include <limits>
#include <vector>

namespace nbd {

/// Nodes that follow a prescribed rigid motion: they translate by `translation` and rotate by `rotation`
/// about `centre` between `start` and `start + duration`, easing in and out, then stay there until `release`,
/// when they become free. The default pins the nodes where they are.
struct Grip {
    std::vector<int> nodes{};                                  // distinct rows of the tet nodes
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();          // metres
    Eigen::Vector3d translation = Eigen::Vector3d::Zero();     // metres, over the whole motion
    Eigen::Vector3d rotation = Eigen::Vector3d::Zero();        // axis times angle, radians, likewise
    double start = 0, duration = 0;                            // seconds; duration 0: at once
    double release = std::numeric_limits<double>::infinity();  // seconds
};

/// Position at `time` of a node that the grip took at x0.
Eigen::Vector3d grip_target(const Grip& grip, const Eigen::Vector3d& x0, double time) noexcept;

/// Throws std::invalid_argument for a node outside 0 .. node_count - 1 or named twice, a non-finite number,
/// or a negative duration.
void check_grip(const Grip& grip, int node_count);

}  // namespace nbd
