#include "tests/sim/support/static_pose.hpp"

namespace nbd::test {

Nodes static_displacements(const ElasticBody& body, const std::vector<int>& held, const Loads& loads,
                           const Nodes& held_at, int load_steps, int newton_iterations) {
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
