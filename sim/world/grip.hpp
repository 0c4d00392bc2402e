#pragma once

#include <Eigen/Core>
#include <limits>
#include <vector>

#include "meshing/surface/mesh.hpp"

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

/// Nodes of a body that are moved from outside, step by step: from their places at `start` on straight lines
/// to their targets at `end`, where they stay.
struct DrivenNodes {
    std::vector<int> nodes;     // distinct rows of the tet nodes
    Nodes from, to;             // [nodes, 3] metres
    double start = 0, end = 0;  // seconds; the same before the step in which they move

    /// Position at `time` of the node with this index in `nodes`.
    Eigen::Vector3d at(Eigen::Index index, double time) const noexcept {
        if (!(time < end)) return to.row(index);
        const double progress = time <= start ? 0 : (time - start) / (end - start);
        return from.row(index) + progress * (to.row(index) - from.row(index));
    }
};

}  // namespace nbd
