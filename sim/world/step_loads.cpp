#include "sim/world/step_loads.hpp"

#include <algorithm>
#include <functional>
#include <utility>

#include "sim/world/gases.hpp"

namespace nbd {
namespace {

/// Forces on the nodes of a body at the positions x, [N, 3] newtons. factor_of: of a load.
Nodes outer_forces(const SteppedBody& body, const Nodes& x,
                   const std::function<double(const Keyed<double>&)>& factor_of) {
    Nodes forces = body.forces;
    for (const LoadForces& one : body.loads) one.add(x, factor_of(one.load().factor), forces);
    return forces;
}

/// Forces of wind k on a body at its unknown w, as they were linearised last, [N, 3] newtons.
Nodes drag_of(const SteppedBody& body, std::size_t k, const Nodes& w) {
    const Drag& drag = body.drags[k];
    Nodes forces = drag.forces;
    for (std::size_t i = 0; i < drag.slopes.size(); ++i)
        forces.row(i) -= body.velocity_factor * (w.row(i) - body.linearised_at.row(i)) * drag.slopes[i];
    return forces;
}

}  // namespace

Nodes end_forces(const WorldState& world, const SteppedBody& body, const Nodes& x) {
    return outer_forces(body, x, [&](const Keyed<double>& factor) {
        return factor.at(world.end(), world.load_share(world.end()));
    });
}

void begin_outer_forces(WorldState& world, const TwoStepWeights& weights) {
    const double sum = weights.now + weights.before;
    const auto mean = [&](const auto& value_at) {
        const auto now = value_at(world.time);
        if (!world.knows_last) return now;
        return decltype(now)((weights.now * now + weights.before * value_at(world.time - world.dt_before)) /
                             sum);
    };
    // What stays as it is does so to the last bit.
    world.gravity_before = world.config.gravity_keys.empty()
                               ? world.config.gravity
                               : mean([&](double time) { return world.gravity_at(time); });
    for (SteppedBody& body : world.bodies)
        body.outer_before = outer_forces(body, body.state.x, [&](const Keyed<double>& factor) {
            return factor.empty() ? 1 : mean([&](double time) { return factor.at(time, 1); });
        });
}

void set_end_forces(const WorldState& world, SteppedBody& body, const Nodes& x) {
    body.outer_end = end_forces(world, body, x);
    if (!body.gases.empty()) body.gas_end = gas_forces(body, x, world.end());
}

Loads outer_end_loads(const WorldState& world, const SteppedBody& body) {
    return {.gravity = world.gravity_at(world.end()), .forces = body.outer_end};
}

Loads end_loads(const WorldState& world, const SteppedBody& body) {
    Loads loads = outer_end_loads(world, body);
    if (body.gas_end.rows() > 0) loads.forces += body.gas_end;
    if (!body.drags.empty()) loads.forces += drag_forces(body, body.linearised_at);
    return loads;
}

double excess_work(const WorldState& world, const SteppedBody& body, const Nodes& from, const Nodes& to) {
    if (std::ranges::none_of(body.loads, [](const LoadForces& one) { return one.load().follows(); }))
        return 0;
    const Nodes way = world.dt * (to - from);
    const double end = world.end();
    const auto work_at = [&](double share) {
        const Nodes x = body.start.x + world.dt * from + share * way;
        Nodes forces = Nodes::Zero(x.rows(), 3);
        for (const LoadForces& one : body.loads)
            if (one.load().follows()) one.add(x, one.load().factor.at(end, world.load_share(end)), forces);
        return forces.cwiseProduct(way).sum();
    };
    const double first = work_at(0);
    return (first - (first + 4 * work_at(0.5) + work_at(1)) / 6) / body.velocity_factor;
}

namespace {

/// Of what changes the motion: errors of smaller forces are told relative to that share of it.
constexpr double of_change = 0.01;

/// What changes the motion of a body's nodes in a step that leads to w: the sum of the lengths of forces,
/// newtons.
double change_of_motion(const WorldState& world, const SteppedBody& body, const Nodes& w) {
    const Nodes gain = body.velocity_factor * w - body.state.v;
    return (body.elastic->node_masses().asDiagonal() * gain).rowwise().norm().sum() / world.dt;
}

}  // namespace

double follow_error(const WorldState& world, const Eigen::VectorXd& v) {
    const double end = world.end();
    double largest = 0;
    for (int b = 0; b < world.body_count(); ++b) {
        const SteppedBody& body = world.at(b);
        const auto follows = [](const LoadForces& one) { return one.load().follows(); };
        if (std::ranges::none_of(body.loads, follows)) continue;
        const Nodes w = world.part_of(b, v), x = body.start.x + world.dt * w;
        Nodes forces = Nodes::Zero(x.rows(), 3), others = body.forces;
        for (const LoadForces& one : body.loads)
            one.add(x, one.load().factor.at(end, world.load_share(end)), follows(one) ? forces : others);
        Nodes off = others + forces - body.outer_end;
        if (!body.springs.empty()) off -= spring_forces(world, body, w);
        const double all =
            std::max(forces.rowwise().norm().sum(), of_change * change_of_motion(world, body, w));
        if (all > 0) largest = std::max(largest, off.rowwise().norm().sum() / all);
    }
    return largest;
}

void take_winds(SteppedBody& body, std::vector<BodyLoad>& loads) {
    for (BodyLoad& load : loads)
        if (load.kind == LoadKind::wind) body.winds.emplace_back(std::move(load), *body.elastic, *body.shape);
    std::erase_if(loads, [](const BodyLoad& load) { return load.kind == LoadKind::wind; });
}

void linearise_loads(const WorldState& world, SteppedBody& body, const Nodes& w) {
    body.drags.clear();
    body.springs.clear();
    const double end = world.end();
    const Nodes x = body.start.x + world.dt * w;
    for (const LoadForces& load : body.loads)
        load.add_springs(x, load.load().factor.at(end, world.load_share(end)), body.springs);
    if (!body.springs.empty() || !body.winds.empty()) body.linearised_at = w;
    if (body.winds.empty()) return;
    const Nodes v = world.config.statics ? Nodes::Zero(w.rows(), 3) : Nodes(body.velocity_factor * w);
    for (const Wind& wind : body.winds) {
        body.drags.push_back(wind.drag(x, v, wind.air_at(end)));
        if (!world.config.statics) continue;
        if (wind.load().air.keys.empty()) body.drags.back().forces *= world.load_share(end);
        body.drags.back().slopes.clear();  // what rests has no velocity
    }
}

Nodes drag_forces(const SteppedBody& body, const Nodes& w) {
    Nodes sum = Nodes::Zero(w.rows(), 3);
    for (std::size_t k = 0; k < body.drags.size(); ++k) sum += drag_of(body, k, w);
    return body.velocity_factor * sum;
}

Nodes spring_forces(const WorldState& world, const SteppedBody& body, const Nodes& w) {
    Nodes pulls = Nodes::Zero(w.rows(), 3);
    const Nodes way = world.dt * (w - body.linearised_at);
    for (const NodeSpring& spring : body.springs) add_pull(spring, way, pulls);
    return -pulls;
}

void add_tangents(const WorldState& world, const SteppedBody& body, const Nodes& w, StepSystem& system) {
    const double dt = world.dt, c = body.velocity_factor;
    system.stiffen(dt * dt / c, body.springs, w);
    for (const Drag& drag : body.drags)
        if (!drag.slopes.empty()) system.resist(c * dt, drag.slopes, w);
}

double drag_energy(const WorldState& world, const SteppedBody& body, const Nodes& w) {
    const double dt = world.dt, c = body.velocity_factor;
    double sum = 0;
    for (std::size_t k = 0; k < body.drags.size(); ++k)
        if (world.config.statics)
            sum -= dt * body.drags[k].forces.cwiseProduct(w).sum();
        else
            sum += dt / c *
                   body.winds[k].potential(body.start.x + dt * body.linearised_at, c * w,
                                           body.winds[k].air_at(world.end()));
    return sum;
}

double drag_error(const WorldState& world, const Eigen::VectorXd& v) {
    double largest = 0;
    for (int b = 0; b < world.body_count(); ++b) {
        const SteppedBody& body = world.at(b);
        if (body.winds.empty() || world.config.statics) continue;
        const Nodes w = world.part_of(b, v), velocity = body.velocity_factor * w;
        double off = 0, all = 0;
        for (std::size_t k = 0; k < body.winds.size(); ++k) {
            const Wind& wind = body.winds[k];
            const Nodes now =
                wind.drag(body.start.x + world.dt * body.linearised_at, velocity, wind.air_at(world.end()))
                    .forces;
            off += (now - drag_of(body, k, w)).rowwise().norm().sum();
            all += now.rowwise().norm().sum();
        }
        all = std::max(all, of_change * change_of_motion(world, body, w));
        if (off > 0) largest = std::max(largest, off / all);
    }
    return largest;
}

void add_wind_reactions(const WorldState& world, double share, int index, const Nodes& w, const Nodes& x,
                        ReactionSums& reactions) {
    const SteppedBody& body = world.at(index);
    for (std::size_t k = 0; k < body.drags.size(); ++k) {
        const Nodes forces = share * drag_of(body, k, w);
        Eigen::Vector3d torque = Eigen::Vector3d::Zero();
        MeanPlace place;
        for (Eigen::Index i = 0; i < x.rows(); ++i) {
            place.add(x.row(i), Eigen::Vector3d(forces.row(i)).norm());
            torque += Eigen::Vector3d(x.row(i)).cross(Eigen::Vector3d(forces.row(i)));
        }
        reactions.add(index, ReactionBy::wind, body.winds[k].load().number,
                      forces.colwise().sum().transpose(), torque, place);
    }
}

}  // namespace nbd
