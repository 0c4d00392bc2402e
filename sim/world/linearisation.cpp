// The linear systems of a part of a step, what is prescribed in it, and how far from balance an iterate is.
#include <algorithm>
#include <limits>

#include "sim/fem/step_system.hpp"
#include "sim/world/world.hpp"

namespace nbd {

/// Fixes from where and until when things move that were given targets since the last step.
void World::start_driving(double dt) {
    go_to_targets(dt);
    for (Body& body : bodies_) {
        DrivenNodes& driven = body.driven;
        if (driven.end > driven.start) continue;
        driven.from = body.state.x(driven.nodes, Eigen::all);
        driven.start = time_;
        driven.end = time_ + dt;
    }
}

/// At the begin of a part: grips whose time has come take their nodes where these are.
void World::take_nodes() {
    for (Body& body : bodies_)
        for (std::size_t g = 0; g < body.grips.size(); ++g)
            if (body.grip_start[g].rows() == 0 && body.grips[g].holds(time_))
                body.grip_start[g] = body.state.x(body.grips[g].nodes, Eigen::all);
}

PrescribedNodes World::prescribed(const Body& body, double dt) const {
    PrescribedNodes result;
    std::vector<Eigen::Vector3d> v;
    const auto add = [&](int node, const Eigen::Vector3d& target) {
        const Eigen::Vector3d x = body.start.x.row(node);
        result.nodes.push_back(node);
        v.push_back((target - x) / dt);
    };
    for (std::size_t g = 0; g < body.grips.size(); ++g) {
        const Grip& grip = body.grips[g];
        if (!grip.holds(time_)) continue;
        const Placing placing = grip.motion.at(time_ + dt);
        for (std::size_t k = 0; k < grip.nodes.size(); ++k)
            add(grip.nodes[k], placing(body.grip_start[g].row(k)));
    }
    const std::vector<int> gripped = result.nodes;  // after a restore, some driven nodes may be gripped again
    for (std::size_t k = 0; k < body.driven.nodes.size(); ++k)
        if (std::ranges::find(gripped, body.driven.nodes[k]) == gripped.end())
            add(body.driven.nodes[k], body.driven.at(k, time_ + dt));
    result.v.resize(v.size(), 3);
    for (std::size_t i = 0; i < v.size(); ++i) result.v.row(i) = v[i];
    return result;
}

/// The unknowns of all bodies, with the given velocities in place.
Eigen::VectorXd World::stacked(Nodes (World::*velocities)(const Body&) const,
                               const std::vector<PrescribedNodes>& given) const {
    Eigen::VectorXd v(first_unknown_.back());
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
        Eigen::Map<Nodes> part(v.data() + first_unknown_[b], bodies_[b].state.v.rows(), 3);
        part = (this->*velocities)(bodies_[b]);
        part(given[b].nodes, Eigen::all) = given[b].v;
    }
    return v;
}

/// iterate: velocities to linearise at; null: as the bodies went before the step.
void World::build_systems(const std::vector<PrescribedNodes>& given, const Eigen::VectorXd* iterate,
                          Tangent tangent) {
    gases_.clear();
    for (int b = 0; b < body_count(); ++b) {
        Body& body = at(b);
        const Nodes w = iterate ? body_part(b, *iterate) : first_iterate(body);
        set_end_forces(body, body.start.x + step_.dt * w);
        linearise_loads(body, w);
        linearise_gases(b, w);
        // What pulls at a rigid body is far beyond its weight, so that an iteration needs how that turns with
        // it.
        const bool is_full = body.elastic->is_rigid() && iterate && tangent == Tangent::rotated;
        systems_[b].assemble(body.start, step_, end_loads(body), w, is_full ? Tangent::full : tangent);
        add_tangents(b, w);
    }
    for (std::size_t b = 0; b < bodies_.size(); ++b) systems_[b].prescribe(given[b]);
}

/// Norm of the residual impulse at v of the body that is farthest from balance, relative to its scale, see
/// ContactSolver::share_of_scales(); 0 where rounding alone leaves as much.
double World::residual(const Eigen::VectorXd& v) {
    solver_.linearise(v);
    constexpr double unit = 4 * std::numeric_limits<double>::epsilon();
    Eigen::VectorXd off = -solver_.impulses(v), rounding = Eigen::VectorXd::Zero(v.size());
    for (int b = 0; b < body_count(); ++b) {
        const StepSystem& system = systems_[b];
        set_end_forces(at(b), at(b).start.x + step_.dt * body_part(b, v));
        linearise_loads(at(b), body_part(b, v));
        const Loads outer = end_loads(at(b));
        const Nodes own = StepPotential(*at(b).elastic, at(b).start, step_, outer, system.elements())
                              .gradient(body_part(b, v));
        Eigen::Map<Nodes>(off.data() + first_unknown_[b], own.rows(), 3) += own;
        const auto& diagonal = system.matrix().diagonal();
        for (int i = 0; i < own.rows(); ++i) {
            const int first = first_unknown_[b] + 3 * i;
            const double motion = v.segment<3>(first).norm() + at(b).start.x.row(i).norm() / step_.dt;
            rounding.segment<3>(first).setConstant(2 * unit * diagonal[i].norm() * motion);
        }
    }
    return solver_.share_of_scales(off, rounding);
}

}  // namespace nbd
