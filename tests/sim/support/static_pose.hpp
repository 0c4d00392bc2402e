#pragma once

#include "sim/fem/backward_euler.hpp"

namespace nbd::test {

/// Static displacements of a body under loads, [N, 3], metres. The `held` nodes have the displacements
/// `held_at` (empty: zero). Takes backward Euler steps long enough for inertia to vanish. One step with one
/// solve is linear elasticity; several steps apply the load gradually and, with several solves each, reach
/// large displacements.
inline Nodes static_displacements(const ElasticBody& body, const std::vector<int>& held, const Loads& loads,
                                  const Nodes& held_at = {}, int load_steps = 1, int newton_iterations = 1) {
    const double dt = 1e5;
    StepSystem system(body);
    PrescribedNodes clamp{held, Nodes::Zero(static_cast<Eigen::Index>(held.size()), 3)};
    if (held_at.size() > 0) clamp.v = held_at / (dt * load_steps);
    BodyState state{body.rest().X, Nodes::Zero(body.node_count(), 3)};
    for (int step = 1; step <= load_steps; ++step) {
        const double share = static_cast<double>(step) / load_steps;
        state.v.setZero();
        backward_euler_step(system, state, dt,
                            {.gravity = share * loads.gravity, .forces = share * loads.forces}, clamp,
                            newton_iterations);
    }
    return state.x - body.rest().X;
}

}  // namespace nbd::test
