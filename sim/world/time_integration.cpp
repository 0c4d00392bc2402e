// Where a step starts from, where it ends and with which momentum.
#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <utility>

#include "sim/world/world.hpp"

namespace nbd {
namespace {

/// Force and torque of outer forces and gravity on a body at the positions x, [N, 3].
Momentum outer_load(const ElasticBody& elastic, NodesRef x, const Loads& loads) {
    const Eigen::RowVector3d centre = centre_of_mass(elastic, x);
    Momentum load{.linear = elastic.mass() * loads.gravity, .angular = Eigen::Vector3d::Zero()};
    for (Eigen::Index i = 0; i < x.rows(); ++i) {
        const Eigen::Vector3d force = loads.forces.row(i), arm = x.row(i) - centre;
        load.linear += force;
        load.angular += arm.cross(force);
    }
    return load;
}

}  // namespace

/// Sets where the step starts for each body, with what the rates before it add. Where the last step of a body
/// is not known, or was much shorter, those before it are taken to be as now, of all bodies: two that touch
/// have to follow the same rule.
void World::choose_steps(double dt) {
    begin_backward_euler(dt);
    if (config_.statics) return;
    const std::vector<Nodes> of_joints = joint_forces(dt);
    for (std::size_t b = 0; b < bodies_.size(); ++b) measure_inner_forces(bodies_[b], dt, of_joints[b]);
    constexpr double straight = 0.3;  // radians, beyond which straight ways by earlier rates lead astray
    if (config_.step.integrator == TimeIntegrator::backward_euler || largest_turn(dt) > straight) return;
    step_ = {dt, 1 / TwoStepWeights::end};
    const bool is_known =
        std::ranges::all_of(bodies_, [](const Body& body) { return body.before.has_value(); });
    knows_last_ = is_known && dt <= most_growth * dt_before_;
    const TwoStepWeights weights(knows_last_ ? dt / dt_before_ : 1);
    begin_outer_forces(weights);
    for (Body& body : bodies_) {
        const Nodes& v_before = knows_last_ ? body.before->v : body.state.v;
        const Nodes& forces_before = knows_last_ ? body.before->inner_forces : body.inner_forces;
        body.start.x += dt * (weights.now * body.state.v + weights.before * v_before);
        body.start.impulses = dt * (weights.now * body.inner_forces + weights.before * forces_before +
                                    (1 - weights.end) * body.outer_before);
        body.start.v.rowwise() += (1 - weights.end) * dt * gravity_before_.transpose();
    }
}

/// Radians by which the fastest rigid body turns in a time.
double World::largest_turn(double dt) const {
    double largest = 0;
    for (const Body& body : bodies_) {
        if (!body.elastic->is_rigid()) continue;
        const Eigen::Matrix3d inertia = rigid_inertia(*body.elastic, body.state.x).bottomRightCorner<3, 3>();
        const Eigen::Vector3d rate = inertia.ldlt().solve(momentum_of(*body.elastic, body.state).angular);
        largest = std::max(largest, dt * rate.norm());
    }
    return largest;
}

/// A step from the state of all bodies as it is.
void World::begin_backward_euler(double dt) {
    for (Body& body : bodies_) body.start = StepStart(body.state);
    step_ = dt;
    knows_last_ = false;
    tensions_.setZero(std::ssize(tendons_));
    begin_outer_forces(TwoStepWeights(1));
}

/// Evaluates inner forces where none are known that a step has balanced: in the first step, and on nodes that
/// are let go, where the balance was that of what held them.
void World::measure_inner_forces(Body& body, double dt, const Nodes& of_joints) {
    const auto measured = [&]() -> Nodes {
        Nodes forces = body.elastic->inner_forces(body.state.x, body.state.v);
        if (of_joints.rows() > 0) forces += of_joints;
        if (!body.gases.empty()) forces += gas_forces(body, body.state.x, time_);
        return forces;
    };
    if (!body.before || body.inner_forces.size() == 0) {
        body.inner_forces = measured();
        return;
    }
    const std::vector<int> held = prescribed(body, dt).nodes;
    if (held == body.before->held) return;
    std::vector<char> is_held(body.state.x.rows(), 0);
    for (const int node : held) is_held[node] = 1;
    const Nodes forces = measured();
    for (const int node : body.before->held)
        for (Nodes* known : {&body.inner_forces, &body.before->inner_forces})
            if (!is_held[node]) known->row(node) = forces.row(node);
}

/// The unknown of the step if the body goes on as before.
Nodes World::first_iterate(const Body& body) const { return body.state.v / step_.velocity_factor; }

/// Whether some of its nodes have prescribed velocities.
bool World::is_held(const Body& body) const {
    return !body.driven.nodes.empty() || std::ranges::any_of(body.grips, [&](const Grip& grip) {
        return grip.holds(time_) && !grip.nodes.empty();
    });
}

/// The unknown of the step if velocities change as in the last step: where the linear solver starts. A body
/// that nothing holds, and of whose last step nothing is known, falls.
Nodes World::likely_velocities(const Body& body) const {
    const double dt = step_.dt;
    if (body.before && dt <= most_growth * dt_before_) {
        const double growth = dt / dt_before_;
        return ((1 + growth) * body.state.v - growth * body.before->v) / step_.velocity_factor;
    }
    if (is_held(body)) return first_iterate(body);
    const Nodes gain = dt * (body.elastic->node_masses().cwiseInverse().asDiagonal() * body.outer_before);
    return ((body.state.v + gain).rowwise() + dt * gravity_before_.transpose()) /
           (step_.velocity_factor * (1 + dt * body.elastic->material().rayleigh_mass));
}

/// Positions of the nodes of all bodies at dt with the unknown v of the step.
std::vector<Nodes> World::nodes_after(double dt, const Eigen::VectorXd& v) const {
    std::vector<Nodes> nodes;
    for (int b = 0; b < body_count(); ++b) nodes.push_back(at(b).start.x + dt * body_part(b, v));
    return nodes;
}

/// Positions at which the impulses of contacts act. In steps of second order they add to the way, in this
/// step and the next, what they would from the middle of this one: with arms of that time, the angular
/// momentum of two bodies that push each other stays, where steps are equal.
Nodes World::middle(const Body& body) const {
    if (step_.velocity_factor == 1) return body.state.x;
    Nodes x = body.state.x + step_.dt / 2 * body.state.v;
    if (knows_last_)
        x -= step_.dt * TwoStepWeights(step_.dt / dt_before_).before * (body.state.v - body.before->v);
    return x;
}

/// The momentum that a body should have at the end of the step, at the positions x, [N, 3]. The solver leaves
/// some of the linear momentum, by its tolerance, and takes or adds angular momentum: it turns a body along
/// straight lines, and neglects how forces turn. contacts: what they give.
Momentum World::end_momentum(int index, NodesRef x, const Momentum& contacts) const {
    const Body& body = at(index);
    const ElasticBody& elastic = *body.elastic;
    const auto [dt, factor] = step_;
    const double begun = dt * (1 - 1 / factor);
    Momentum momentum = momentum_of(elastic, body.state);
    Loads end{.gravity = gravity_at(time_ + dt), .forces = end_forces(body, x, dt)};
    if (!body.drags.empty()) end.forces += drag_forces(body, (x - body.start.x) / dt);
    const Momentum first = outer_load(elastic, body.state.x,
                                      {.gravity = gravity_before_, .forces = body.outer_before}),
                   last = outer_load(elastic, x, end);
    momentum.linear += begun * first.linear;
    momentum.angular += begun * first.angular;
    const Momentum springs = earlier_springs_on(index);
    momentum.linear += springs.linear;
    momentum.angular += springs.angular;
    const double lasting = factor * (1 + dt * elastic.material().rayleigh_mass);
    return {(factor * momentum.linear + dt * last.linear + contacts.linear) / lasting,
            (factor * momentum.angular + dt * last.angular + contacts.angular) / lasting};
}

/// Takes what holds nodes out of the forces that balanced the motion, so that inner forces alone are left
/// there, too. They sum to what springs do: what they have instead, as the solver left it, is shared by the
/// held nodes. holding: impulses of the solver, [held, 3]. springs: their impulse at the end, as the solver
/// has it.
void World::take_holding(int index, const Nodes& holding, const Eigen::RowVector3d& springs) {
    Body& body = at(index);
    const auto [dt, factor] = step_;
    const std::vector<int>& held = body.before->held;
    body.holding = holding / factor;
    if (held.empty()) return;
    body.inner_forces(held, Eigen::all) -= holding / dt;
    Eigen::RowVector3d left = dt / factor * body.inner_forces.colwise().sum();
    if (body.start.impulses.rows() > 0)
        left +=
            body.start.impulses.colwise().sum() - (1 - 1 / factor) * dt * body.outer_before.colwise().sum();
    left -= springs / factor + earlier_springs_on(index).linear.transpose();
    body.holding.rowwise() += left / static_cast<double>(held.size());
}

/// w: the solution of the step. impulses: those on the nodes that act in it alone, stacked; all: with those
/// of springs. The inner forces that the next step needs are what balances the motion: where elements are
/// stiff, forces evaluated at its end would be mostly what they make of the solver's errors. Held nodes keep
/// the velocity of their straight way; those of a grip that stands or jumps, none.
void World::advance(int index, const Nodes& w, const Eigen::VectorXd& impulses, const Eigen::VectorXd& all) {
    Body& body = at(index);
    const auto [dt, factor] = step_;
    body.before = {
        .v = body.state.v, .inner_forces = std::move(body.inner_forces), .held = prescribed(body, dt).nodes};
    const Nodes holding = body.before->held.empty() ? Nodes(0, 3) : holding_impulses(index, w, all);
    const double lasting = 1 + dt * body.elastic->material().rayleigh_mass;
    const Nodes x = body.start.x + dt * w;
    Nodes now = factor * w;
    body.inner_forces = body.elastic->mass_product((factor / dt * (lasting * now - body.start.v)).rowwise() -
                                                   gravity_at(time_ + dt).transpose()) -
                        body.outer_end - body_part(index, impulses) / dt;
    if (!body.drags.empty()) body.inner_forces -= drag_forces(body, w);
    if (!body.springs.empty()) body.inner_forces -= spring_forces(body, w);
    if (body.start.impulses.rows() > 0) body.inner_forces -= factor / dt * body.start.impulses;
    take_holding(index, holding, body_part(index, all - impulses).colwise().sum());
    const std::vector<int>& held = body.before->held;
    const Nodes solved = now(held, Eigen::all);
    for (const int node : held) now.row(node) = (x.row(node) - body.state.x.row(node)) / dt;
    for (const Grip& grip : body.grips)
        if (grip.holds(time_) && grip.motion.rests(time_, time_ + dt))
            for (const int node : grip.nodes) now.row(node).setZero();
    for (std::size_t k = 0; k < held.size(); ++k)  // what gives held nodes the velocity of their way
        body.holding.row(k) +=
            lasting * body.elastic->node_masses()[held[k]] * (now.row(held[k]) - solved.row(k));
    body.state.x = x;  // in place: arrays keep their place in memory
    body.state.v = now;
}

}  // namespace nbd
