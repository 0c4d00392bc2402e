#include "sim/world/time_rule.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <utility>

#include "meshing/parallel/parallel_for.hpp"
#include "sim/world/gases.hpp"
#include "sim/world/step_loads.hpp"

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

/// Evaluates inner forces where none are known that a step has balanced: in the first step, and on nodes that
/// are let go, where the balance was that of what held them.
void measure_inner_forces(const WorldState& world, SteppedBody& body, double dt, const Nodes& of_joints) {
    const auto measured = [&]() -> Nodes {
        Nodes forces = body.elastic->inner_forces(body.state.x, body.state.v);
        if (of_joints.rows() > 0) forces += of_joints;
        if (!body.gases.empty()) forces += gas_forces(body, body.state.x, world.time);
        return forces;
    };
    if (!body.before || body.inner_forces.size() == 0) {
        body.inner_forces = measured();
        return;
    }
    const std::vector<int> held = world.prescribed(body, dt).nodes;
    if (held == body.before->held) return;
    std::vector<char> is_held(body.state.x.rows(), 0);
    for (const int node : held) is_held[node] = 1;
    const Nodes forces = measured();
    for (const int node : body.before->held)
        for (Nodes* known : {&body.inner_forces, &body.before->inner_forces})
            if (!is_held[node]) known->row(node) = forces.row(node);
}

/// Takes what holds nodes out of the forces that balanced the motion, so that inner forces alone are left
/// there, too. They sum to what springs do: what they have instead, as the solver left it, is shared by the
/// held nodes. holding: impulses of the solver, [held, 3]. springs: their impulse at the end, as the solver
/// has it.
void take_holding(WorldState& world, const JointForces& joints, int index, const Nodes& holding,
                  const Eigen::RowVector3d& springs) {
    SteppedBody& body = world.at(index);
    const auto [dt, factor] = world.step;
    const std::vector<int>& held = body.before->held;
    body.holding = holding / factor;
    if (held.empty()) return;
    body.inner_forces(held, Eigen::all) -= holding / dt;
    Eigen::RowVector3d left = dt / factor * body.inner_forces.colwise().sum();
    if (body.start.impulses.rows() > 0)
        left +=
            body.start.impulses.colwise().sum() - (1 - 1 / factor) * dt * body.outer_before.colwise().sum();
    left -= springs / factor + joints.earlier_on(world, index).linear.transpose();
    body.holding.rowwise() += left / static_cast<double>(held.size());
}

}  // namespace

void choose_steps(WorldState& world, JointForces& joints, const LargestTurns& turns, double dt) {
    begin_backward_euler(world, dt);
    if (world.config.statics) return;
    const std::vector<Nodes> of_joints = joints.measure(world, dt);
    for (std::size_t b = 0; b < world.bodies.size(); ++b)
        measure_inner_forces(world, world.bodies[b], dt, of_joints[b]);
    constexpr double straight =
        0.3;  // radians of a rigid body, beyond which straight ways by earlier rates lead astray
    if (world.config.step.integrator == TimeIntegrator::backward_euler) return;
    if (turns.rigid.angle > straight || turns.deformable.angle > most_deformable_turn) return;
    world.step = {dt, 1 / TwoStepWeights::end};
    const bool is_known =
        std::ranges::all_of(world.bodies, [](const SteppedBody& body) { return body.before.has_value(); });
    world.knows_last = is_known && dt <= most_growth * world.dt_before;
    const TwoStepWeights weights(world.knows_last ? dt / world.dt_before : 1);
    begin_outer_forces(world, weights);
    for (SteppedBody& body : world.bodies) {
        const Nodes& v_before = world.knows_last ? body.before->v : body.state.v;
        const Nodes& forces_before = world.knows_last ? body.before->inner_forces : body.inner_forces;
        body.start.x += dt * (weights.now * body.state.v + weights.before * v_before);
        body.start.impulses = dt * (weights.now * body.inner_forces + weights.before * forces_before +
                                    (1 - weights.end) * body.outer_before);
        body.start.v.rowwise() += (1 - weights.end) * dt * world.gravity_before.transpose();
    }
}

LargestTurns largest_turns(const WorldState& world, double dt) {
    std::vector<double> angles(world.bodies.size(), 0.0);
    const auto measure = [&](int b) {
        const SteppedBody& body = world.at(b);
        if (world.can_turn(body)) angles[b] = dt * angular_velocity(*body.elastic, body.state).norm();
    };
    parallel_for(world.body_count(), measure, 1);
    LargestTurns largest;
    for (int b = 0; b < world.body_count(); ++b) {
        LargestTurn& of_kind = world.at(b).elastic->is_rigid() ? largest.rigid : largest.deformable;
        if (angles[b] > of_kind.angle) of_kind = {angles[b], b};
    }
    return largest;
}

LargestTurn largest_rigid_turn(const WorldState& world, const Eigen::VectorXd& v) {
    LargestTurn largest;
    for (int b = 0; b < world.body_count(); ++b) {
        const SteppedBody& body = world.at(b);
        if (!body.elastic->is_rigid() || !world.can_turn(body)) continue;
        const Nodes way = body.start.x + world.step.dt * world.part_of(b, v) - body.state.x;
        const double angle = angular_velocity(*body.elastic, {.x = body.state.x, .v = way}).norm();
        if (angle > largest.angle) largest = {angle, b};
    }
    return largest;
}

void begin_backward_euler(WorldState& world, double dt) {
    for (SteppedBody& body : world.bodies) body.start = StepStart(body.state);
    world.step = dt;
    world.knows_last = false;
    begin_outer_forces(world, TwoStepWeights(1));
}

Nodes first_iterate(const WorldState& world, const SteppedBody& body) {
    return body.state.v / world.step.velocity_factor;
}

Nodes likely_velocities(const WorldState& world, const SteppedBody& body) {
    const double dt = world.step.dt;
    if (body.before && dt <= most_growth * world.dt_before) {
        const double growth = dt / world.dt_before;
        return ((1 + growth) * body.state.v - growth * body.before->v) / world.step.velocity_factor;
    }
    if (world.is_held(body)) return first_iterate(world, body);
    const Nodes gain = dt * (body.elastic->node_masses().cwiseInverse().asDiagonal() * body.outer_before);
    return ((body.state.v + gain).rowwise() + dt * world.gravity_before.transpose()) /
           (world.step.velocity_factor * (1 + dt * body.elastic->material().rayleigh_mass));
}

Nodes middle(const WorldState& world, const SteppedBody& body) {
    if (world.step.velocity_factor == 1) return body.state.x;
    Nodes x = body.state.x + world.step.dt / 2 * body.state.v;
    if (world.knows_last)
        x -= world.step.dt * TwoStepWeights(world.step.dt / world.dt_before).before *
             (body.state.v - body.before->v);
    return x;
}

Momentum end_momentum(const WorldState& world, const JointForces& joints, int index, NodesRef x,
                      const Momentum& contacts) {
    const SteppedBody& body = world.at(index);
    const ElasticBody& elastic = *body.elastic;
    const auto [dt, factor] = world.step;
    const double begun = dt * (1 - 1 / factor);
    Momentum momentum = momentum_of(elastic, body.state);
    Loads end{.gravity = world.gravity_at(world.time + dt), .forces = end_forces(world, body, x)};
    if (!body.drags.empty()) end.forces += drag_forces(world, body, (x - body.start.x) / dt);
    const Momentum first = outer_load(elastic, body.state.x,
                                      {.gravity = world.gravity_before, .forces = body.outer_before}),
                   last = outer_load(elastic, x, end);
    momentum.linear += begun * first.linear;
    momentum.angular += begun * first.angular;
    const Momentum springs = joints.earlier_on(world, index);
    momentum.linear += springs.linear;
    momentum.angular += springs.angular;
    const double lasting = factor * (1 + dt * elastic.material().rayleigh_mass);
    return {(factor * momentum.linear + dt * last.linear + contacts.linear) / lasting,
            (factor * momentum.angular + dt * last.angular + contacts.angular) / lasting};
}

Nodes holding_impulses(const WorldState& world, const StepSystem& system, int index, const Nodes& w,
                       const Eigen::VectorXd& impulses) {
    const SteppedBody& body = world.at(index);
    const Eigen::VectorXd v = Eigen::Map<const Eigen::VectorXd>(w.data(), w.size());
    const std::vector<int> nodes = world.prescribed(body, world.step.dt).nodes;
    Nodes holding;
    if (world.config.step.newton_iterations > 1) {
        const Loads outer = end_loads(world, body);
        holding = StepPotential(*body.elastic, body.start, world.step, outer, system.elements())
                      .gradient(w)(nodes, Eigen::all);
    } else {
        holding = system.holding_impulses(v);
    }
    return holding - world.part_of(index, impulses)(nodes, Eigen::all);
}

void advance(WorldState& world, const JointForces& joints, const StepSystem& system, int index,
             const Nodes& w, const Eigen::VectorXd& impulses, const Eigen::VectorXd& all) {
    SteppedBody& body = world.at(index);
    const auto [dt, factor] = world.step;
    body.before = {.v = body.state.v,
                   .inner_forces = std::move(body.inner_forces),
                   .held = world.prescribed(body, dt).nodes};
    const Nodes holding =
        body.before->held.empty() ? Nodes(0, 3) : holding_impulses(world, system, index, w, all);
    const double lasting = 1 + dt * body.elastic->material().rayleigh_mass;
    const Nodes x = body.start.x + dt * w;
    Nodes now = factor * w;
    body.inner_forces = body.elastic->mass_product((factor / dt * (lasting * now - body.start.v)).rowwise() -
                                                   world.gravity_at(world.time + dt).transpose()) -
                        body.outer_end - world.part_of(index, impulses) / dt;
    if (!body.drags.empty()) body.inner_forces -= drag_forces(world, body, w);
    if (!body.springs.empty()) body.inner_forces -= spring_forces(world, body, w);
    if (body.start.impulses.rows() > 0) body.inner_forces -= factor / dt * body.start.impulses;
    take_holding(world, joints, index, holding, world.part_of(index, all - impulses).colwise().sum());
    const std::vector<int>& held = body.before->held;
    const Nodes solved = now(held, Eigen::all);
    for (const int node : held) now.row(node) = (x.row(node) - body.state.x.row(node)) / dt;
    for (const Grip& grip : body.grips)
        if (grip.holds(world.time) && grip.motion.rests(world.time, world.time + dt))
            for (const int node : grip.nodes) now.row(node).setZero();
    for (std::size_t k = 0; k < held.size(); ++k)  // what gives held nodes the velocity of their way
        body.holding.row(k) +=
            lasting * body.elastic->node_masses()[held[k]] * (now.row(held[k]) - solved.row(k));
    body.state.x = x;  // in place: arrays keep their place in memory
    body.state.v = now;
}

}  // namespace nbd
