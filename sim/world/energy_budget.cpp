#include "sim/world/energy_budget.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "meshing/parallel/parallel_for.hpp"
#include "sim/contact/contact_terms.hpp"

namespace nbd {
namespace {

/// Of a rigid body that of its motion as a whole: straight ways strain it.
double kinetic(const ElasticBody& elastic, const BodyState& state, const Momentum& momentum,
               const Eigen::Vector3d& spin) {
    if (!elastic.is_rigid()) return kinetic_energy(elastic, state.v);
    return momentum.linear.squaredNorm() / (2 * elastic.mass()) + momentum.angular.dot(spin) / 2;
}

/// Seen from something with the velocity u.
double seen_from(const Eigen::Vector3d& u, double energy, const Momentum& momentum, double mass) {
    return energy - momentum.linear.dot(u) + mass / 2 * u.squaredNorm();
}

/// Whether a motion that a jointed body is to get has no more energy than it and a fall in the step explain.
bool is_explained(const WorldState& world, const RigidVector& motion, int index) {
    constexpr double share = 2;
    const SteppedBody& body = world.at(index);
    const double energy = motion.dot(rigid_inertia(*body.elastic, body.state.x) * motion) / 2,
                 fall = body.elastic->mass() * (world.gravity_before * world.dt).squaredNorm();
    return energy <= share * (kinetic_energy(*body.elastic, body.state.v) +
                              kinetic_energy(*body.elastic, body.before->v) + fall);
}

}  // namespace

/// Bodies that touch or are joined.
struct EnergyBudget::Group {
    std::vector<int> bodies{};
    bool is_explained = true;     // what its jointed bodies are to get
    bool has_free_rigid = false;  // without joints, and nothing holds it
};

EnergyBudget::EnergyBudget(const WorldState& world, const StepEquations& equations,
                           const Eigen::VectorXd& v) {
    start_.resize(world.bodies.size());
    const auto measure = [&](int b) {
        const SteppedBody& body = world.at(b);
        Start& start = start_[b];
        start.momentum = momentum_of(*body.elastic, body.state);
        const Nodes way = body.start.x + world.dt * world.part_of(b, v) - body.state.x;
        start.mean_velocity =
            way.transpose() * body.elastic->node_masses() / (world.dt * body.elastic->mass());
        start.spin = angular_velocity(*body.elastic, body.state);
        start.energy =
            kinetic(*body.elastic, body.state, start.momentum, angular_velocity(*body.elastic, body.state)) +
            body.energy;
    };
    parallel_for(world.body_count(), measure, 1);
    ContactTerms terms;
    std::size_t count = 0;
    for (const RubbedContact& one : equations.solver.rubbed(v)) {
        if (one.contact.obstacle < 0) continue;
        terms.add(one.contact, equations.shapes, world.first_unknown);
        Eigen::Vector3d wall = one.contact.wall_velocity;
        for (const CouplingTerm& t :
             terms.of(count)) {  // the velocities that earlier rates have taken from it
            const SteppedBody& body = world.at(t.body);
            wall += t.weight / world.dt * (body.start.x.row(t.node) - body.state.x.row(t.node)).transpose();
        }
        ++count;
        Start& start = start_[one.contact.a.body];
        start.pressed += std::abs(one.pressed);
        start.walls += std::abs(one.pressed) * wall;
    }
}

double EnergyBudget::share(const WorldState& world, const Group& group,
                           std::span<const RigidVector> gains) const {
    const auto counts = [&](int b) { return !world.is_joined(b) && !world.is_held(world.at(b)); };
    double pressed = 0, mass = 0, driven_mass = 0;
    Eigen::Vector3d walls = Eigen::Vector3d::Zero(), linear = walls, driven = walls;
    bool is_second_order = true;
    for (const int b : group.bodies) {
        const Start& start = start_[b];
        const double of_body = world.at(b).elastic->mass();
        pressed += start.pressed;
        walls += start.walls;
        if (counts(b)) {
            mass += of_body;
            linear += start.momentum.linear;
            is_second_order = is_second_order && world.at(b).velocity_factor > 1;
        } else {
            driven_mass += of_body;
            driven += momentum_of(*world.at(b).elastic, world.at(b).state).linear;
        }
    }
    Eigen::Vector3d u = linear / mass;
    if (pressed > 0)
        u = walls / pressed;
    else if (driven_mass > 0)
        u = driven / driven_mass;
    double begun = 0, work = 0, solved = 0, slope = 0, square = 0;  // joules
    for (const int b : group.bodies) {
        if (!counts(b)) continue;
        const Start& start = start_[b];
        const SteppedBody& body = world.at(b);
        const ElasticBody& elastic = *body.elastic;
        const RigidMatrix inertia = rigid_inertia(elastic, body.state.x);
        const Momentum momentum = momentum_of(elastic, body.state);
        const Eigen::Vector3d spin = angular_velocity(elastic, body.state);
        const double of_body = elastic.mass();
        begun += seen_from(u, start.energy, start.momentum, of_body);
        solved += seen_from(u, kinetic(elastic, body.state, momentum, spin) + body.energy, momentum, of_body);
        RigidVector relative;
        relative << momentum.linear - of_body * u, momentum.angular;
        slope += gains[b].dot(relative);
        square += gains[b].dot(inertia * gains[b]) / 2;
        work += start.loads.linear.dot(start.mean_velocity - u) +
                start.loads.angular.dot(start.spin + spin + gains[b].tail<3>()) / 2;
    }
    // Steps of second order have their energy in their rates, too.
    const double tolerance = is_second_order ? 0.1 : 1e-3;
    const double most = std::max(solved, begun + std::max(work, 0.0)), allowed = most - solved;
    if (slope + square <= allowed + tolerance * most) return 1;
    // The larger root of square s^2 + slope s = allowed.
    return std::clamp((std::sqrt(slope * slope + 4 * square * allowed) - slope) / (2 * square), 0.0, 1.0);
}

std::vector<double> EnergyBudget::shares(const WorldState& world, std::span<const RigidVector> gains,
                                         std::span<const PairImpulse> touching) const {
    BodyGroups connected(world.bodies.size());
    for (std::size_t j = 0; j < world.joints.size(); ++j)
        if (!world.broken[j]) connected.connect(world.joints[j].joint().a, world.joints[j].joint().b);
    for (const PairImpulse& pair : touching) connected.connect(pair.body, pair.other);
    std::map<int, Group> groups;
    for (int b = 0; b < world.body_count(); ++b) {
        Group& group = groups[connected.group_of(b)];
        group.bodies.push_back(b);
        const bool is_joined = world.is_joined(b);
        if (is_joined) group.is_explained = group.is_explained && is_explained(world, gains[b], b);
        group.has_free_rigid = group.has_free_rigid ||
                               (world.at(b).elastic->is_rigid() && !is_joined && !world.is_held(world.at(b)));
    }
    std::vector<double> shares(world.bodies.size(), 1);
    for (const auto& [first, group] : groups) {
        double share = group.is_explained ? 1 : 0;
        if (share > 0 && group.has_free_rigid) share = this->share(world, group, gains);
        for (const int b : group.bodies) shares[b] = share;
    }
    return shares;
}

}  // namespace nbd
