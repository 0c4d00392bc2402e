#include "sim/world/time_rule.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <utility>

#include "meshing/parallel/parallel_for.hpp"
#include "sim/materials/polar.hpp"
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

/// Which bodies joints and tendons connect. One that is held throughout passes nothing on.
BodyGroups joined_groups(const WorldState& world) {
    std::vector<char> moves;  // [bodies]
    for (const SteppedBody& body : world.bodies) moves.push_back(!world.is_held_throughout(body));
    BodyGroups groups(world.bodies.size());
    const auto join = [&](int joint, int& first) {
        for (const int body : {world.joints[joint].joint().a, world.joints[joint].joint().b}) {
            if (body < 0 || !moves[body]) continue;
            if (first < 0) first = body;
            groups.connect(first, body);
        }
    };
    for (int j = 0; j < std::ssize(world.joints); ++j)
        if (int first = -1; !world.broken[j]) join(j, first);
    for (const Tendon& tendon : world.tendons) {
        int first = -1;
        for (const int part : tendon.parts) join(part, first);
    }
    return groups;
}

/// Evaluates inner forces where none are known that a step has balanced: in the first step, and on nodes that
/// are let go, where the balance was that of what held them. Rates before a step that is not known are taken
/// to be as now.
void measure_inner_forces(const WorldState& world, SteppedBody& body, double dt, const Nodes& of_joints) {
    const auto measured = [&]() -> Nodes {
        Nodes forces = body.elastic->inner_forces(body.state.x, body.state.v);
        if (of_joints.rows() > 0) forces += of_joints;
        if (!body.gases.empty()) forces += gas_forces(body, body.state.x, world.time);
        return forces;
    };
    const std::vector<int> held = world.prescribed(body, dt).nodes;
    if (!body.before || body.inner_forces.size() == 0) body.inner_forces = measured();
    if (!body.before) body.before = {.v = body.state.v, .inner_forces = body.inner_forces, .held = held};
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
/// held nodes, with its torque where all are held. holding: impulses of the solver, [held, 3]. springs: their
/// impulses at the end, as the solver has them, [N, 3]. x: positions there.
void take_holding(WorldState& world, const JointForces& joints, int index, const Nodes& holding,
                  const Nodes& springs, const Nodes& x) {
    SteppedBody& body = world.at(index);
    const auto [dt, factor] = world.step_of(body);
    const std::vector<int>& held = body.before->held;
    body.holding = holding;
    if (held.empty()) return;
    body.inner_forces(held, Eigen::all) -= factor / dt * holding;
    const ElasticBody& elastic = *body.elastic;
    const Momentum end = outer_load(elastic, x, {.forces = dt / factor * body.inner_forces - springs}),
                   earlier = joints.earlier_on(world, index);
    RigidVector left;
    left << end.linear - earlier.linear, end.angular - earlier.angular;
    if (body.start.impulses.rows() > 0) {
        const Momentum start =
            outer_load(elastic, body.state.x,
                       {.forces = body.start.impulses - (1 - 1 / factor) * dt * body.outer_before});
        left.head<3>() += start.linear;
        left.tail<3>() += start.angular;
    }
    if (std::ssize(held) < x.rows()) {
        body.holding.rowwise() += left.head<3>().transpose() / static_cast<double>(held.size());
        return;
    }
    BodyState moved{x, Nodes::Zero(x.rows(), 3)};
    add_motion(elastic, rigid_inertia(elastic, x).ldlt().solve(left), moved);
    body.holding += elastic.mass_product(moved.v)(held, Eigen::all);
}

}  // namespace

void choose_steps(WorldState& world, JointForces& joints, std::span<const double> turns, double dt) {
    const bool goes_on =
        !world.config.statics && world.config.step.integrator != TimeIntegrator::backward_euler;
    world.dt = dt;
    world.knows_last = goes_on && dt <= most_growth * world.dt_before;
    for (SteppedBody& body : world.bodies) {
        body.start = StepStart(body.state);
        body.velocity_factor = 1;
    }
    const TwoStepWeights weights(world.knows_last ? dt / world.dt_before : 1);
    begin_outer_forces(world, weights);
    if (world.config.statics) return;
    const std::vector<Nodes> of_joints = joints.measure(world, dt);
    for (std::size_t b = 0; b < world.bodies.size(); ++b)
        measure_inner_forces(world, world.bodies[b], dt, of_joints[b]);
    if (!goes_on) return;
    for (SteppedBody& body : world.bodies) {
        const Nodes& v_before = world.knows_last ? body.before->v : body.state.v;
        const Nodes& forces_before = world.knows_last ? body.before->inner_forces : body.inner_forces;
        body.velocity_factor = 1 / TwoStepWeights::end;
        body.start.x += dt * (weights.now * body.state.v + weights.before * v_before);
        body.start.impulses = dt * (weights.now * body.inner_forces + weights.before * forces_before +
                                    (1 - weights.end) * body.outer_before);
        body.start.v.rowwise() += (1 - weights.end) * dt * world.gravity_before.transpose();
    }
    constexpr double straight =
        0.3;  // radians of a rigid body, beyond which straight ways by earlier rates lead astray
    std::vector<char> abrupt(world.bodies.size(), 0);
    // After a much shorter step, what that step's straight way has strained a rigid body by would go on.
    const bool grows = world.dt_before > 0 && !world.knows_last;
    for (int b = 0; b < world.body_count(); ++b)
        abrupt[b] =
            world.at(b).elastic->is_rigid() ? grows || turns[b] > straight : turns[b] > most_deformable_turn;
    add_joined(world, abrupt);
    take_backward_euler(world, abrupt);
}

void add_joined(const WorldState& world, std::vector<char>& some) {
    if (world.joints.empty() || std::ranges::find(some, 1) == some.end()) return;
    BodyGroups groups = joined_groups(world);
    std::vector<char> has_some(some.size(), 0);  // of groups
    for (int b = 0; b < world.body_count(); ++b)
        if (some[b]) has_some[groups.group_of(b)] = 1;
    for (int b = 0; b < world.body_count(); ++b) some[b] = has_some[groups.group_of(b)];
}

std::vector<char> anchored_bodies(const WorldState& world) {
    std::vector<char> anchored(world.bodies.size(), 0);
    const auto is_held = [&](int body) { return body < 0 || world.is_held(world.at(body)); };
    for (int b = 0; b < world.body_count(); ++b) anchored[b] = is_held(b);
    for (std::size_t j = 0; j < world.joints.size(); ++j) {
        const int a = world.joints[j].joint().a, b = world.joints[j].joint().b;
        if (world.broken[j] || !(is_held(a) || is_held(b))) continue;
        for (const int body : {a, b})
            if (body >= 0) anchored[body] = 1;
    }
    add_joined(world, anchored);
    return anchored;
}

bool take_backward_euler(WorldState& world, std::span<const char> abrupt) {
    bool is_new = false;
    for (std::size_t b = 0; b < abrupt.size(); ++b) {
        if (!abrupt[b] || world.is_held_throughout(world.bodies[b])) continue;
        is_new = is_new || world.bodies[b].velocity_factor > 1;
        world.bodies[b].start = StepStart(world.bodies[b].state);
        world.bodies[b].velocity_factor = 1;
    }
    return is_new;
}

void forget_rates(SteppedBody& body) {
    if (!body.before || body.inner_forces.size() == 0) {
        body.before.reset();
        return;
    }
    body.before->v = body.state.v;
    body.before->inner_forces = body.inner_forces;
}

std::vector<double> turns_in(const WorldState& world, double dt) {
    std::vector<double> angles(world.bodies.size(), 0.0);
    const auto measure = [&](int b) {
        const SteppedBody& body = world.at(b);
        if (world.can_turn(body)) angles[b] = dt * angular_velocity(*body.elastic, body.state).norm();
    };
    parallel_for(world.body_count(), measure, 1);
    return angles;
}

std::vector<double> rigid_turns(const WorldState& world, const Eigen::VectorXd& v) {
    std::vector<double> angles(world.bodies.size(), 0.0);
    const auto measure = [&](int b) {
        const SteppedBody& body = world.at(b);
        if (!body.elastic->is_rigid() || !world.can_turn(body)) return;
        const Nodes end = body.start.x + world.dt * world.part_of(b, v);
        const Eigen::Matrix3d turn =
            rotation_of(body.elastic->deformation_gradient(end, 0)) *
            rotation_of(body.elastic->deformation_gradient(body.state.x, 0)).transpose();
        angles[b] = std::acos(std::clamp((turn.trace() - 1) / 2, -1.0, 1.0));
    };
    parallel_for(world.body_count(), measure, 1);
    return angles;
}

Nodes first_iterate(const WorldState&, const SteppedBody& body) {
    return body.state.v / body.velocity_factor;
}

Nodes likely_velocities(const WorldState& world, const SteppedBody& body) {
    const double dt = world.dt;
    if (body.before && dt <= most_growth * world.dt_before) {
        const double growth = dt / world.dt_before;
        return ((1 + growth) * body.state.v - growth * body.before->v) / body.velocity_factor;
    }
    if (world.is_held(body)) return first_iterate(world, body);
    const Nodes gain = dt * (body.elastic->node_masses().cwiseInverse().asDiagonal() * body.outer_before);
    return ((body.state.v + gain).rowwise() + dt * world.gravity_before.transpose()) /
           (body.velocity_factor * (1 + dt * body.elastic->material().rayleigh_mass));
}

Nodes middle(const WorldState& world, const SteppedBody& body) {
    if (body.velocity_factor == 1) return body.state.x;
    Nodes x = body.state.x + world.dt / 2 * body.state.v;
    if (world.knows_last)
        x -= world.dt * TwoStepWeights(world.dt / world.dt_before).before * (body.state.v - body.before->v);
    return x;
}

Momentum load_impulse(const WorldState& world, int index, NodesRef x) {
    const SteppedBody& body = world.at(index);
    const auto [dt, factor] = world.step_of(body);
    const double begun = dt * (1 - 1 / factor);
    Loads end{.gravity = world.gravity_at(world.time + dt), .forces = end_forces(world, body, x)};
    if (!body.drags.empty()) end.forces += drag_forces(body, (x - body.start.x) / dt);
    const Momentum first = outer_load(*body.elastic, body.state.x,
                                      {.gravity = world.gravity_before, .forces = body.outer_before}),
                   last = outer_load(*body.elastic, x, end);
    return {begun * first.linear + dt / factor * last.linear,
            begun * first.angular + dt / factor * last.angular};
}

Momentum end_momentum(const WorldState& world, const JointForces& joints, int index, const Momentum& loads,
                      const Momentum& contacts) {
    const SteppedBody& body = world.at(index);
    const Momentum begun = momentum_of(*body.elastic, body.state), springs = joints.earlier_on(world, index);
    const double lasting = 1 + world.dt * body.elastic->material().rayleigh_mass;
    return {(begun.linear + loads.linear + springs.linear + contacts.linear) / lasting,
            (begun.angular + loads.angular + springs.angular + contacts.angular) / lasting};
}

Nodes holding_impulses(const WorldState& world, const StepEquations& equations, int index, const Nodes& w,
                       const Eigen::VectorXd& impulses) {
    const StepSystem& system = equations.systems[index];
    const SteppedBody& body = world.at(index);
    const Eigen::VectorXd v = Eigen::Map<const Eigen::VectorXd>(w.data(), w.size());
    const std::vector<int> nodes = world.prescribed(body, world.dt).nodes;
    Nodes holding;
    if (equations.are_balanced) {
        const Loads outer = end_loads(world, body);
        holding = StepPotential(*body.elastic, body.start, world.step_of(body), outer, system.elements())
                      .gradient(w)(nodes, Eigen::all);
    } else {
        holding = system.holding_impulses(v);
    }
    return holding - world.part_of(index, impulses)(nodes, Eigen::all);
}

void advance(WorldState& world, const JointForces& joints, const StepEquations& equations, int index,
             const Nodes& w, const Eigen::VectorXd& impulses, const Eigen::VectorXd& all) {
    SteppedBody& body = world.at(index);
    const auto [dt, factor] = world.step_of(body);
    body.before = {.v = body.state.v,
                   .inner_forces = std::move(body.inner_forces),
                   .held = world.prescribed(body, dt).nodes};
    const Nodes holding =
        body.before->held.empty() ? Nodes(0, 3) : holding_impulses(world, equations, index, w, all);
    const double lasting = 1 + dt * body.elastic->material().rayleigh_mass;
    const Nodes x = body.start.x + dt * w;
    Nodes now = factor * w;
    body.inner_forces = body.elastic->mass_product((factor / dt * (lasting * now - body.start.v)).rowwise() -
                                                   world.gravity_at(world.time + dt).transpose()) -
                        body.outer_end - factor / dt * world.part_of(index, impulses);
    if (!body.drags.empty()) body.inner_forces -= drag_forces(body, w);
    if (!body.springs.empty()) body.inner_forces -= spring_forces(world, body, w);
    if (body.start.impulses.rows() > 0) body.inner_forces -= factor / dt * body.start.impulses;
    take_holding(world, joints, index, holding, world.part_of(index, all - impulses), x);
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
