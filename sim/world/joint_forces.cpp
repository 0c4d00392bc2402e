#include "sim/world/joint_forces.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <variant>

#include "collision/base/notice.hpp"
#include "sim/world/time_rule.hpp"

namespace nbd {
namespace {

void add(Momentum& sum, const Momentum& more, double times = 1) {
    sum.linear += times * more.linear;
    sum.angular += times * more.angular;
}

/// Whether a bond is of a rope or tendon that is told to stretch.
bool stretches(const WorldState& world, const Bond& bond) {
    if (const int tendon = world.tendon_of(bond.joint); tendon >= 0)
        return world.tendons[tendon].stiffness > 0;
    const auto* cord = std::get_if<CordJoint>(&world.joints[bond.joint].joint().kind);
    return cord && cord->stiffness > 0;
}

/// How far the two points of a bond have gone from each other since the start of the step, with the nodes at
/// x.
Eigen::Vector3d way(const ContactTerms& terms, std::size_t bond, const WorldState& world,
                    std::span<const Nodes> x) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const CouplingTerm& t : terms.of(bond))
        sum += t.weight * (x[t.body].row(t.node) - world.bodies[t.body].state.x.row(t.node)).transpose();
    return sum;
}

/// Lets a cord pull along its direction at the start of a step, where its impulse acts in backward Euler, so
/// that two bodies keep their angular momentum; or else along the mean of that and the one at the end: along
/// the last one alone it would take energy from what swings on it. start: Bond::difference there.
void pull_along(Bond& bond, const Eigen::Vector3d& start, bool from_start) {
    const double length = bond.difference.norm();
    const Eigen::Vector3d end = bond.difference.normalized();
    if (!((start.normalized() + end).norm() > 1)) return;  // turned by more than 120 degrees
    if (from_start) bond.acts_at = Bond::Time::start;
    // Twice as long as it may be, so that its stretch turns no faster with the direction than before.
    const Eigen::Vector3d along =
        2 * length * (from_start ? start.normalized() : (start.normalized() + end).normalized());
    bond.law.length += along.norm() - length;
    bond.difference = along;
}

}  // namespace

std::vector<Bond> bonds_at(const WorldState& world, const Eigen::VectorXd& v, std::span<const char> caught) {
    std::vector<Bond> found;
    if (world.joints.empty()) return found;
    const double dt = world.dt;
    const std::vector<Nodes> x = world.nodes_after(dt, v);
    for (std::size_t j = 0; j < world.joints.size(); ++j)
        if (!world.broken[j]) world.joints[j].add(x, world.time + dt, dt, found);
    // On what is anchored, a pull along the start of each step of backward Euler would make energy; the
    // impulse of a catch does not.
    const std::vector<char> anchored = anchored_bodies(world);
    ContactTerms terms;
    for (std::size_t k = 0; k < found.size(); ++k) {
        terms.add(found[k], world.first_unknown);
        Bond& bond = found[k];
        const bool is_cord = world.tendon_of(bond.joint) >= 0 || (bond.law.is_radial() && !bond.is_spring);
        const double c = bond.velocity_factor = world.velocity_factor_of(bond.a.body, bond.b.body);
        if (!bond.is_spring && c > 1) bond.acts_at = Bond::Time::middle;
        const bool catches = caught[bond.a.body] || (bond.b.body >= 0 && caught[bond.b.body]);
        if (is_cord && !world.config.statics && (c > 1 || catches || !anchored[bond.a.body]))
            pull_along(bond, bond.difference - way(terms, k, world, x), c == 1);
        bond.difference -= dt * terms.velocity(k, v);
        if (c == 1)
            for (const CouplingTerm& t : terms.of(k)) {
                const SteppedBody& body = world.at(t.body);
                bond.lead += t.weight / dt * (body.start.x - body.state.x).row(t.node).transpose();
            }
        if (world.config.statics) bond.law.damping = 0;
        if (bond.is_spring && c > 1) bond.law *= 1 / c;  // the rest acts by what it did before
    }
    return found;
}

std::string joint_fault(const WorldState& world, std::span<const Bond> bonds, const Eigen::VectorXd& v) {
    ContactTerms terms;
    for (std::size_t k = 0; k < bonds.size(); ++k) {
        const Bond& bond = bonds[k];
        terms.add(bond, world.first_unknown);
        const double stiffness =
            std::max(bond.law.stiffness, bond.law.K.selfadjointView<Eigen::Lower>().operatorNorm());
        if (bond.is_spring || stretches(world, bond) || world.broken[bond.joint] || !(stiffness > 0))
            continue;
        const double gives =
            bond.law.at(bond.difference + world.dt * terms.velocity(k, v)).gradient.norm() / stiffness;
        const JointBonds& joint = world.joints[bond.joint];
        if (gives > joint.most_give())
            return fmt::format(
                "joint \"{}\" gives by {:.3g} m, more than {:.3g} m: it bears too much, or contradicts another "
                "joint or a grip",
                joint.joint().name, gives, joint.most_give());
    }
    return {};
}

std::vector<char> caught_bodies(const WorldState& world, const StepEquations& equations,
                                const Eigen::VectorXd& v) {
    struct Cord {
        double now = 0, mean = 0;  // rates of its length: at the start of the part, and in it, m/s
        double ends = 0;           // of the vector between its ends
        bool pulls = false;
        std::vector<int> bodies{};
    };
    std::vector<char> caught(world.bodies.size(), 0);
    const auto may_catch = [&](const Bond& bond) {
        return (bond.law.pulls_only || world.tendon_of(bond.joint) >= 0) && !stretches(world, bond) &&
               bond.velocity_factor > 1;
    };
    if (std::ranges::none_of(equations.bonds, may_catch)) return caught;
    const double dt = world.dt;
    const std::vector<Nodes> x = world.nodes_now(), after = world.nodes_after(dt, v);
    std::vector<Cord> cords(world.tendons.size());  // of tendons, then of ropes and limits
    ContactTerms terms;
    for (std::size_t k = 0; k < equations.bonds.size(); ++k) {
        const Bond& bond = equations.bonds[k];
        terms.add(bond, world.first_unknown);
        if (!may_catch(bond)) continue;
        const JointBonds& joint = world.joints[bond.joint];
        const bool is_cord = std::holds_alternative<CordJoint>(joint.joint().kind);
        const int tendon = world.tendon_of(bond.joint);
        Eigen::Vector3d rate = Eigen::Vector3d::Zero();
        for (const CouplingTerm& t : terms.of(k))
            rate += t.weight * world.bodies[t.body].state.v.row(t.node).transpose();
        const Eigen::Vector3d span = is_cord ? joint.span(x) : bond.law.along,
                              way = nbd::way(terms, k, world, after);
        Cord& one = tendon < 0 ? cords.emplace_back() : cords[tendon];
        one.now += rate.dot(span.normalized());
        one.mean += (is_cord ? (span + way).norm() - span.norm() : way.dot(span)) / dt;
        one.ends += rate.norm();
        one.pulls = one.pulls || !equations.solver.bond_impulse(k, v).isZero(0);
        for (const CarriedPoint* point : {&bond.a, &bond.b})
            if (point->body >= 0) one.bodies.push_back(point->body);
    }
    constexpr double share = 0.1, of_fall = 1e-3, of_size = 1e-9;
    const double fall = of_fall * world.gravity_at(world.time).norm() * dt;
    for (const Cord& one : cords) {
        double size = std::numeric_limits<double>::infinity();
        for (const int body : one.bodies) size = std::min(size, world.at(body).shape->rest_diagonal);
        const double off = std::abs(one.mean - one.now);
        if (one.pulls && off > std::max(fall, of_size * size / dt) &&
            off > share * std::max(std::abs(one.mean), one.ends))
            for (const int body : one.bodies) caught[body] = 1;
    }
    return caught;
}

std::vector<Nodes> JointForces::measure(const WorldState& world, double dt) {
    std::vector<Nodes> forces;
    for (const SteppedBody& body : world.bodies)
        forces.push_back(Nodes::Zero(world.joints.empty() ? 0 : body.state.x.rows(), 3));
    now_.assign(world.joints.size(), {});
    if (world.joints.empty()) return forces;
    BodyPositions at{.x = world.nodes_now(), .centres = {}};
    at.centres = world.centres_of(at.x);
    std::vector<Bond> bonds;
    for (std::size_t j = 0; j < world.joints.size(); ++j)
        if (!world.broken[j]) world.joints[j].add(at.x, world.time, dt, bonds);
    std::erase_if(bonds, [](const Bond& bond) { return !bond.is_spring; });
    ContactTerms terms;
    for (std::size_t k = 0; k < bonds.size(); ++k) {
        const Bond& bond = bonds[k];
        terms.add(bond, world.first_unknown);
        Eigen::Vector3d u = Eigen::Vector3d::Zero();
        for (const CouplingTerm& t : terms.of(k))
            u += t.weight * world.bodies[t.body].state.v.row(t.node).transpose();
        const BondLaw::Terms law = bond.law.at(bond.difference);
        const Eigen::Vector3d force = -law.gradient - law.drag * u;
        for (const CouplingTerm& t : terms.of(k)) forces[t.body].row(t.node) += t.weight * force.transpose();
        std::vector<Momentum> loads(world.bodies.size());
        terms.add_momentum(k, force, at, loads);
        add(now_[bond.joint].on_a, loads[bond.a.body]);
        if (bond.b.body >= 0) add(now_[bond.joint].on_b, loads[bond.b.body]);
    }
    for (std::size_t j = 0; j < world.joints.size(); ++j) {
        const Joint& joint = world.joints[j].joint();
        if (!world.at(joint.a).before || (joint.b >= 0 && !world.at(joint.b).before)) before_[j] = now_[j];
    }
    return forces;
}

void JointForces::forget(const WorldState& world, std::span<const char> bodies) {
    measure(world, world.dt);
    for (std::size_t j = 0; j < world.joints.size(); ++j) {
        const Joint& joint = world.joints[j].joint();
        if (bodies[joint.a] || (joint.b >= 0 && bodies[joint.b])) before_[j] = now_[j];
    }
}

JointLoad JointForces::earlier(const WorldState& world, std::size_t joint) const {
    JointLoad sum;
    const Joint& between = world.joints[joint].joint();
    if (world.velocity_factor_of(between.a, between.b) == 1) return sum;
    const TwoStepWeights weights(world.knows_last ? world.dt / world.dt_before : 1);
    const JointLoad &now = now_[joint], &before = world.knows_last ? before_[joint] : now;
    for (Momentum JointLoad::*side : {&JointLoad::on_a, &JointLoad::on_b}) {
        add(sum.*side, now.*side, world.dt * weights.now);
        add(sum.*side, before.*side, world.dt * weights.before);
    }
    return sum;
}

Momentum JointForces::earlier_on(const WorldState& world, int body) const {
    Momentum sum;
    for (std::size_t j = 0; j < world.joints.size(); ++j) {
        const Joint& joint = world.joints[j].joint();
        if (joint.a != body && joint.b != body) continue;
        const JointLoad begun = earlier(world, j);
        add(sum, joint.a == body ? begun.on_a : begun.on_b);
    }
    return sum;
}

void JointForces::add_reactions(const WorldState& world, const StepEquations& equations, double rate,
                                const Eigen::VectorXd& v, std::span<const Eigen::Vector3d> more,
                                const ImpulsePlaces& at, ReactionSums& reactions) const {
    const auto& [systems, steps, shapes, contacts, bonds, solver, are_balanced] = equations;
    std::vector<JointLoad> sums(world.joints.size());  // impulses, about the origin
    std::vector<MeanPlace> places(world.joints.size());
    for (std::size_t k = 0; k < bonds.size(); ++k) {
        const Eigen::Vector3d impulse = solver.bond_impulse(k, v, more), place = solver.bond_place(k, at);
        JointLoad& sum = sums[bonds[k].joint];
        const Momentum on_a{impulse, place.cross(impulse)};
        places[bonds[k].joint].add(place, rate * impulse.norm());
        add(sum.on_a, on_a);
        add(sum.on_b, on_a, -1);
    }
    for (std::size_t j = 0; j < world.joints.size(); ++j) {
        if (world.broken[j]) continue;
        const Joint& joint = world.joints[j].joint();
        const JointLoad begun = earlier(world, j);
        const auto tell = [&](int body, Momentum sum, const Momentum& before) {
            if (body < 0) return;
            add(sum, {before.linear, before.angular + at.middles.centres[body].cross(before.linear)});
            reactions.add(body, ReactionBy::joint, static_cast<int>(j), rate * sum.linear, rate * sum.angular,
                          places[j]);
        };
        tell(joint.a, sums[j].on_a, begun.on_a);
        tell(joint.b, sums[j].on_b, begun.on_b);
    }
}

void JointForces::break_joints(WorldState& world, const StepEquations& equations, const Eigen::VectorXd& v) {
    const auto& [systems, steps, shapes, contacts, bonds, solver, are_balanced] = equations;
    const double dt = world.dt;
    std::vector<Eigen::Vector3d> forces(world.joints.size(), Eigen::Vector3d::Zero());
    for (std::size_t k = 0; k < bonds.size(); ++k)
        forces[bonds[k].joint] +=
            (bonds[k].is_spring ? bonds[k].velocity_factor : 1) / dt * solver.bond_impulse(k, v);
    for (std::size_t j = 0; j < world.joints.size(); ++j)
        if (!world.broken[j] && forces[j].norm() > world.joints[j].joint().strength) {
            world.broken[j] = 1;
            notice(fmt::format("joint \"{}\" breaks at {:.6g} s, under {:.3g} N",
                               world.joints[j].joint().name, world.end(), forces[j].norm()));
            world.forget_steps(world.joints[j].joint());
            before_[j] = {};
        }
}

}  // namespace nbd
