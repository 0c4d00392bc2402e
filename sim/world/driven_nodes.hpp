#pragma once

#include <vector>

#include "meshing/surface/mesh.hpp"

namespace nbd {

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
