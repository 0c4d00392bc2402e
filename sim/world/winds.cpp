// How loads answer to the motion in a step: those of muscles turn with the body, those of winds fall with its
// velocities. Like a contact, a wind acts with its whole impulse in a step, as it is at
// its end: so air at rest takes energy in steps of any length.
#include <algorithm>
#include <utility>

#include "sim/world/world.hpp"

namespace nbd {

/// Takes the winds out of the loads of a body that is being added.
void World::add_winds(Body& body, std::vector<BodyLoad>& loads) {
    for (BodyLoad& load : loads)
        if (load.kind == LoadKind::wind) body.winds.emplace_back(std::move(load), *body.elastic, *body.shape);
    std::erase_if(loads, [](const BodyLoad& load) { return load.kind == LoadKind::wind; });
}

/// Linearises the winds and muscles of a body at its unknown w, as they are at the end of the part.
void World::linearise_loads(Body& body, const Nodes& w) {
    body.drags.clear();
    body.springs.clear();
    const double end = time_ + step_.dt;
    const Nodes x = body.start.x + step_.dt * w;
    for (const LoadForces& load : body.loads)
        load.add_springs(x, load.load().factor.at(end, load_share(end)), body.springs);
    if (!body.springs.empty() || !body.winds.empty()) body.linearised_at = w;
    if (body.winds.empty()) return;
    const Nodes v = config_.statics ? Nodes::Zero(w.rows(), 3) : Nodes(step_.velocity_factor * w);
    for (const Wind& wind : body.winds) {
        body.drags.push_back(wind.drag(x, v, wind.air_at(end)));
        if (!config_.statics) continue;
        if (wind.load().air.keys.empty()) body.drags.back().forces *= load_share(end);
        body.drags.back().slopes.clear();  // what rests has no velocity
    }
}

/// Forces of wind k on a body at its unknown w, as they were linearised last, [N, 3] newtons.
Nodes World::drag_forces(const Body& body, std::size_t k, const Nodes& w) const {
    const Drag& drag = body.drags[k];
    Nodes forces = drag.forces;
    for (std::size_t i = 0; i < drag.slopes.size(); ++i)
        forces.row(i) -= step_.velocity_factor * (w.row(i) - body.linearised_at.row(i)) * drag.slopes[i];
    return forces;
}

/// Of all winds on a body: their forces times what makes their whole impulses act in the step.
Nodes World::drag_forces(const Body& body, const Nodes& w) const {
    Nodes sum = Nodes::Zero(w.rows(), 3);
    for (std::size_t k = 0; k < body.drags.size(); ++k) sum += drag_forces(body, k, w);
    return step_.velocity_factor * sum;
}

/// By what the forces of muscles change up to the unknown w of a step, [N, 3] newtons.
Nodes World::spring_forces(const Body& body, const Nodes& w) const {
    Nodes pulls = Nodes::Zero(w.rows(), 3);
    const Nodes way = step_.dt * (w - body.linearised_at);
    for (const NodeSpring& spring : body.springs) add_pull(spring, way, pulls);
    return -pulls;
}

/// Lets the system of a body answer to its unknown as its winds and muscles do.
void World::add_tangents(int index, const Nodes& w) {
    const double dt = step_.dt, c = step_.velocity_factor;
    systems_[index].stiffen(dt * dt, at(index).springs, w);
    for (const Drag& drag : at(index).drags)
        if (!drag.slopes.empty()) systems_[index].resist(c * c * dt, drag.slopes, w);
}

/// What winds add to the potential of the step of a body at its unknown w, in the pose in which they were
/// linearised last, joules.
double World::drag_energy(const Body& body, const Nodes& w) const {
    const double dt = step_.dt;
    double sum = 0;
    for (std::size_t k = 0; k < body.drags.size(); ++k)
        if (config_.statics)
            sum -= dt * body.drags[k].forces.cwiseProduct(w).sum();
        else
            sum += dt * body.winds[k].potential(body.start.x + dt * body.linearised_at,
                                                step_.velocity_factor * w, body.winds[k].air_at(time_ + dt));
    return sum;
}

/// By how much winds at the unknowns v of the step act otherwise than was solved for, as a share of what they
/// do, or of a hundredth of what changes the motion of their body. The largest of all bodies.
double World::drag_error(const Eigen::VectorXd& v) const {
    constexpr double of_change = 0.01;
    double largest = 0;
    for (int b = 0; b < body_count(); ++b) {
        const Body& body = at(b);
        if (body.winds.empty() || config_.statics) continue;
        const Nodes w = body_part(b, v), velocity = step_.velocity_factor * w;
        double off = 0, all = 0;
        for (std::size_t k = 0; k < body.winds.size(); ++k) {
            const Wind& wind = body.winds[k];
            const Nodes now = wind.drag(body.start.x + step_.dt * body.linearised_at, velocity,
                                        wind.air_at(time_ + step_.dt))
                                  .forces;
            off += (now - drag_forces(body, k, w)).rowwise().norm().sum();
            all += now.rowwise().norm().sum();
        }
        const Nodes change = body.elastic->node_masses().asDiagonal() * (velocity - body.state.v) / step_.dt;
        all = std::max(all, of_change * change.rowwise().norm().sum());
        if (off > 0) largest = std::max(largest, off / all);
    }
    return largest;
}

/// Adds what winds did on a body in a part whose unknown is w. x: where it acts, [N, 3].
void World::add_wind_reactions(const StepPart& part, int index, const Nodes& w, const Nodes& x) {
    const Body& body = at(index);
    for (std::size_t k = 0; k < body.drags.size(); ++k) {
        const Nodes forces = part.share * drag_forces(body, k, w);
        Eigen::Vector3d torque = Eigen::Vector3d::Zero();
        MeanPlace place;
        for (Eigen::Index i = 0; i < x.rows(); ++i) {
            place.add(x.row(i), Eigen::Vector3d(forces.row(i)).norm());
            torque += Eigen::Vector3d(x.row(i)).cross(Eigen::Vector3d(forces.row(i)));
        }
        reactions_.add(index, ReactionBy::wind, body.winds[k].load().number,
                       forces.colwise().sum().transpose(), torque, place);
    }
}

}  // namespace nbd
