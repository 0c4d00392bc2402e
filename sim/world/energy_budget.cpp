#include "sim/world/energy_budget.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "meshing/parallel/parallel_for.hpp"
#include "sim/contact/contact_terms.hpp"

namespace nbd {
namespace {

/// Kinetic and elastic; of a rigid body that of its motion as a whole: straight ways strain it.
double energy_of(const SteppedBody& body, const Momentum& momentum, const Eigen::Vector3d& spin) {
    if (!body.elastic->is_rigid()) return kinetic_energy(*body.elastic, body.state.v) + body.energy;
    return momentum.linear.squaredNorm() / (2 * body.elastic->mass()) + momentum.angular.dot(spin) / 2;
}

/// Seen from something with the velocity u.
double seen_from(const Eigen::Vector3d& u, double energy, const Momentum& momentum, double mass) {
    return energy - momentum.linear.dot(u) + mass / 2 * u.squaredNorm();
}

/// Whether a motion that a jointed body is to get has no more energy than it and a fall in the step explain,
/// seen from something with the velocity u.
bool is_explained(const WorldState& world, const RigidVector& motion, int index, const Eigen::Vector3d& u) {
    constexpr double share = 2;
    const SteppedBody& body = world.at(index);
    const double energy = motion.dot(rigid_inertia(*body.elastic, body.state.x) * motion) / 2,
                 fall = body.elastic->mass() * (world.gravity_before * world.dt).squaredNorm();
    const auto seen = [&](const Nodes& v) {
        return kinetic_energy(*body.elastic, v.rowwise() - u.transpose());
    };
    return energy <= share * (seen(body.state.v) + seen(body.before->v) + fall);
}

/// Whether a joint takes energy at most: no motor, winch, tension or spring.
bool drives_nothing(const Joint& joint) {
    const auto is_free = [](const JointFreedom& freedom) {
        return freedom.motor.empty() && freedom.stiffness == 0;
    };
    if (const auto* hinge = std::get_if<HingeJoint>(&joint.kind)) return is_free(hinge->angle);
    if (const auto* slider = std::get_if<SliderJoint>(&joint.kind)) return is_free(slider->way);
    if (const auto* cord = std::get_if<CordJoint>(&joint.kind))
        return cord->stiffness == 0 && cord->winch.empty() && cord->tension.empty();
    return true;
}

/// The velocity of the place where a body is touched, as of one that does not deform.
Eigen::Vector3d velocity_at(const SteppedBody& body, const Eigen::Vector3d& place) {
    const Momentum momentum = momentum_of(*body.elastic, body.state);
    const Eigen::Vector3d arm = place - centre_of_mass(*body.elastic, body.state.x);
    return momentum.linear / body.elastic->mass() + angular_velocity(*body.elastic, body.state).cross(arm);
}

}  // namespace

/// Bodies that touch or are joined. What holds a body lets it have nothing, so that it connects none.
struct EnergyBudget::Group {
    std::vector<int> bodies{};
    std::vector<PairImpulse> driven{};  // of free bodies and of those that joints or something else drive
    bool has_free_rigid = false;        // without joints, and nothing holds it
    bool is_left_alone = true;          // has rigid bodies, nothing holds it, its joints drive nothing
    int anchors = 0;                    // joints to the world, or to something held
    Eigen::Vector3d of_anchors = Eigen::Vector3d::Zero();  // sum of their velocities, m/s
};

bool EnergyBudget::limits(const WorldState& world) {
    return !world.joints.empty() || std::ranges::any_of(world.bodies, [](const SteppedBody& body) {
        return body.elastic->is_rigid();
    });
}

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
        start.energy = energy_of(body, start.momentum, start.spin);
    };
    parallel_for(world.body_count(), measure, 1);
    ContactTerms terms;
    std::size_t count = 0;
    for (const RubbedContact& one : equations.solver.rubbed(v)) {
        if (one.contact.obstacle < 0) continue;
        terms.add(one.contact, equations.shapes, world.first_unknown);
        Eigen::Vector3d wall = one.contact.wall_velocity;
        // The velocities that earlier rates have taken from it.
        for (const CouplingTerm& t : terms.of(count)) {
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
    const auto counts = [&](int b) {
        return group.is_left_alone || (!world.is_joined(b) && !world.is_held(world.at(b)));
    };
    double pressed = 0, mass = 0;
    Eigen::Vector3d walls = Eigen::Vector3d::Zero(), linear = walls;
    bool is_second_order = true;
    for (const int b : group.bodies) {
        if (!counts(b)) continue;
        pressed += start_[b].pressed;
        walls += start_[b].walls;
        mass += world.at(b).elastic->mass();
        linear += start_[b].momentum.linear;
        is_second_order = is_second_order && world.at(b).velocity_factor > 1;
    }
    const Eigen::Vector3d u = pressed > 0 ? Eigen::Vector3d(walls / pressed) : Eigen::Vector3d(linear / mass);
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
        solved += seen_from(u, energy_of(body, momentum, spin), momentum, of_body);
        RigidVector relative;
        relative.head<3>() = momentum.linear - of_body * u;
        relative.tail<3>() = momentum.angular;
        slope += gains[b].dot(relative);
        square += gains[b].dot(inertia * gains[b]) / 2;
        work += start.loads.linear.dot(start.mean_velocity - u) +
                start.loads.angular.dot(start.spin + spin + gains[b].tail<3>()) / 2;
    }
    for (const PairImpulse& pair : group.driven) {  // what drives bodies works on them
        if (group.is_left_alone) break;
        const bool is_first = counts(pair.body);
        const Eigen::Vector3d on_free = is_first ? pair.linear : Eigen::Vector3d(-pair.linear);
        work += on_free.dot(velocity_at(world.at(is_first ? pair.other : pair.body), pair.place.mean()) - u);
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
    const auto is_held = [&](int b) { return b >= 0 && world.is_held(world.at(b)); };
    const auto is_free = [&](int b) { return !is_held(b) && !world.is_joined(b); };
    BodyGroups connected(world.bodies.size());
    const auto connect = [&](int a, int b) {
        if (!is_held(a) && !is_held(b)) connected.connect(a, b);
    };
    for (std::size_t j = 0; j < world.joints.size(); ++j)
        if (!world.broken[j]) connect(world.joints[j].joint().a, world.joints[j].joint().b);
    for (const PairImpulse& pair : touching) connect(pair.body, pair.other);
    std::map<int, Group> groups;
    for (int b = 0; b < world.body_count(); ++b) {
        Group& group = groups[connected.group_of(b)];
        group.bodies.push_back(b);
        group.has_free_rigid = group.has_free_rigid || (world.at(b).elastic->is_rigid() && is_free(b));
        group.is_left_alone = group.is_left_alone && !is_held(b);
    }
    for (std::size_t j = 0; j < world.joints.size(); ++j) {
        const Joint& joint = world.joints[j].joint();
        if (world.broken[j]) continue;
        if (!drives_nothing(joint))
            for (const int body : {joint.a, joint.b})
                if (body >= 0) groups[connected.group_of(body)].is_left_alone = false;
        for (const auto& [body, other] : {std::pair(joint.a, joint.b), std::pair(joint.b, joint.a)}) {
            if (body < 0 || is_held(body) || (other >= 0 && !is_held(other))) continue;
            Group& group = groups[connected.group_of(body)];
            group.is_left_alone = false;
            ++group.anchors;
            if (other >= 0)
                group.of_anchors += velocity_at(
                    world.at(other), centre_of_mass(*world.at(body).elastic, world.at(body).state.x));
        }
    }
    for (const PairImpulse& pair : touching)
        if (pair.other >= 0 && is_free(pair.body) != is_free(pair.other))
            groups[connected.group_of(is_free(pair.body) ? pair.body : pair.other)].driven.push_back(pair);
    std::vector<double> shares(world.bodies.size(), 1);
    for (auto& [first, group] : groups) {
        double mass = 0;
        Eigen::Vector3d u = Eigen::Vector3d::Zero();
        for (const int b : group.bodies) {
            mass += world.at(b).elastic->mass();
            u += start_[b].momentum.linear;
        }
        u = group.anchors > 0 ? Eigen::Vector3d(group.of_anchors / group.anchors) : Eigen::Vector3d(u / mass);
        group.is_left_alone = group.is_left_alone && std::ranges::any_of(group.bodies, [&](int b) {
                                  return world.at(b).elastic->is_rigid();
                              });
        const bool explained = std::ranges::all_of(
            group.bodies, [&](int b) { return !world.is_joined(b) || is_explained(world, gains[b], b, u); });
        double share = explained ? 1 : 0;
        if (group.is_left_alone || (explained && group.has_free_rigid))
            share = this->share(world, group, gains);
        for (const int b : group.bodies) shares[b] = share;
    }
    return shares;
}

}  // namespace nbd
