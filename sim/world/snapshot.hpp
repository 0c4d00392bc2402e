#pragma once

#include <vector>

#include "sim/contact/friction_memory.hpp"
#include "sim/fem/elastic_body.hpp"
#include "sim/world/joint.hpp"

namespace nbd {

/// What a step has to know of the one before it.
struct PastStep {
    Nodes v;                // velocities at its start, [N, 3] m/s
    Nodes inner_forces;     // of elasticity, its damping and springs there, [N, 3] newtons
    std::vector<int> held;  // nodes with prescribed velocities in the step
};

/// The state of a world, without its bodies, obstacles, joints and outer forces. A world built from the same
/// ones and restored from a snapshot continues with the same bits. Plain arrays, reals in double, so that a
/// file can keep them exactly.
struct WorldSnapshot {
    double time = 0;                // seconds
    double dt_before = 0;           // length of the part of a step that ended here, seconds; 0: none
    std::vector<BodyState> bodies;  // positions and velocities, one per body
    // Forces of elasticity, its damping and joints on the nodes as the last step has balanced them, [N, 3]
    // newtons, and what that step began with, of each body. Empty arrays or an empty list: not known. Whoever
    // changes `bodies` has to clear both.
    std::vector<Nodes> inner_forces;
    std::vector<PastStep> before;
    FrictionStretches stretches;
    // Where grips took their nodes that take them after the body was added: [bodies][grips][nodes, 3],
    // metres, without rows of the others and of those that have not taken them. Empty: none have.
    std::vector<std::vector<Nodes>> taken_at;
    std::vector<char> broken{};  // [joints]; empty: none is
    std::vector<JointLoad>
        springs_before{};  // [joints] of springs at the start of the last step; empty: none
};

}  // namespace nbd
