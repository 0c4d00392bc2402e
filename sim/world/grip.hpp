#pragma once

#include <Eigen/Core>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "meshing/surface/mesh.hpp"
#include "sim/obstacles/motion.hpp"

namespace nbd {

/// Nodes that follow a motion that is told in advance, from `take` until `release`, when they become free.
/// They are displaced from where they are at `take`. The default pins the nodes where they are at once.
struct Grip {
    std::vector<int> nodes{};  // distinct rows of the tet nodes
    Motion motion{};
    double take = 0;                                           // seconds
    double release = std::numeric_limits<double>::infinity();  // seconds, >= take

    /// Whether it holds in a step that begins at `time`.
    bool holds(double time) const noexcept;
};

/// Throws std::invalid_argument for a node outside 0 .. node_count - 1 or named twice, and for times and a
/// motion that cannot be.
void check_grip(const Grip& grip, int node_count);

/// Two grips that hold a node at the same time.
struct GripsAtOdds {
    std::size_t first = 0, second = 0;  // their numbers
    int node = 0;
    double from = 0;  // seconds
};
/// The first such two; none: every node has one holder at a time.
std::optional<GripsAtOdds> grips_at_odds(std::span<const Grip> grips);

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
