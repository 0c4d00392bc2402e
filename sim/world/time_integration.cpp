// Which rule advances a body, where its step starts from, where it ends and with which momentum.
#include <Eigen/Geometry>
#include <algorithm>

#include "sim/world/world.hpp"

namespace nbd {

/// BDF2 for bodies without driven nodes and without a grip that jumps, neither in this step nor in the one
/// before it: BDF2 would extrapolate the jump. A barrier is a smooth potential, so that it holds in contact.
void World::choose_steps(double dt) {
    const bool is_bdf2 = config_.step.integrator == TimeIntegrator::bdf2;
    for (Body& body : bodies_) {
        const bool jumps = std::ranges::any_of(body.grips, [&](const Grip& grip) {
            const bool moves = !grip.translation.isZero(0) || !grip.rotation.isZero(0);
            return moves && grip.duration == 0 && grip.start > time_ - dt_before_ && grip.start <= time_ + dt;
        });
        body.keeps_state = is_bdf2 && !jumps && body.driven.nodes.empty();
        if (!body.keeps_state) body.before.reset();
        body.start = {.state = {}, .step = dt};
        if (body.before && dt <= max_bdf2_growth * dt_before_)
            body.start = bdf2_start(*body.before, body.state, dt_before_, dt);
    }
}

/// The unknown of the step if the body goes on as before.
Nodes World::first_iterate(const Body& body) const {
    if (!takes_bdf2(body)) return body.state.v;
    const double growth = body.start.step.dt / dt_before_;
    return ((1 + growth) * body.state.v - growth * body.before->v) / body.start.step.velocity_factor;
}

/// Whether some of its nodes have prescribed velocities.
bool World::is_held(const Body& body) const {
    return !body.driven.nodes.empty() || std::ranges::any_of(body.grips, [&](const Grip& grip) {
        return time_ < grip.release && !grip.nodes.empty();
    });
}

/// The unknown of the step if velocities change as in the last step: where the linear solver starts. A body
/// that nothing holds, and of whose last step nothing is known, falls.
Nodes World::likely_velocities(const Body& body) const {
    constexpr double max_growth = 2;  // of the step length; a longer one asks too much of the last change
    const double dt = body.start.step.dt, growth = dt / dt_before_;
    if (takes_bdf2(body)) return first_iterate(body);
    if (body.velocities_before.size() == 0 || growth > max_growth) {
        if (is_held(body)) return first_iterate(body);
        const Nodes gain = dt * (body.elastic->node_masses().cwiseInverse().asDiagonal() * body.forces);
        return ((body.state.v + gain).rowwise() + dt * config_.gravity.transpose()) /
               (1 + dt * body.elastic->material().rayleigh_mass);
    }
    return (1 + growth) * body.state.v - growth * body.velocities_before;
}

/// Positions of the nodes of all bodies at dt with the unknown v of the step.
std::vector<Nodes> World::nodes_after(double dt, const Eigen::VectorXd& v) const {
    std::vector<Nodes> nodes;
    for (int b = 0; b < body_count(); ++b) nodes.push_back(start_of(at(b)).x + dt * body_part(b, v));
    return nodes;
}

/// The momentum that a body should have at the end of the step, at the positions x, [N, 3]. The solver leaves
/// some of the linear momentum, by its tolerance, and takes or adds angular momentum: it turns a body along
/// straight lines, and neglects how forces turn. contacts: what they give.
Momentum World::end_momentum(const Body& body, NodesRef x, const Momentum& contacts) const {
    const ElasticBody& elastic = *body.elastic;
    const auto [dt, factor] = body.start.step;
    Momentum momentum = momentum_of(elastic, body.state);
    if (takes_bdf2(body)) {
        const double q = body.start.share_before;
        const Momentum before = momentum_of(elastic, *body.before);
        momentum.linear += q * (momentum.linear - before.linear);
        momentum.angular += q * (momentum.angular - before.angular);
    }
    const Eigen::RowVector3d centre = centre_of_mass(elastic, x);
    Eigen::Vector3d force = elastic.mass() * config_.gravity, torque = Eigen::Vector3d::Zero();
    for (Eigen::Index i = 0; i < x.rows(); ++i) {
        const Eigen::Vector3d outer = body.forces.row(i), arm = x.row(i) - centre;
        force += outer;
        torque += arm.cross(outer);
    }
    const double lasting = factor + dt * elastic.material().rayleigh_mass;
    return {(factor * momentum.linear + dt * force + contacts.linear) / lasting,
            (factor * momentum.angular + dt * torque + contacts.angular) / lasting};
}

/// v: the solution of the step.
void World::advance(Body& body, const Nodes& v) {
    const auto [dt, factor] = body.start.step;
    if (body.keeps_state)
        body.before = body.state;
    else
        body.before.reset();
    body.velocities_before = body.state.v;
    body.state.x = start_of(body).x + dt * v;
    body.state.v = factor * v;
}

}  // namespace nbd
