#include "sim/world/joint_forces.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <variant>

#include "collision/base/notice.hpp"

namespace nbd {
namespace {

void add(Momentum& sum, const Momentum& more, double times = 1) {
    sum.linear += times * more.linear;
    sum.angular += times * more.angular;
}

}  // namespace

std::vector<Bond> bonds_at(const WorldState& world, const Eigen::VectorXd& v) {
    std::vector<Bond> found;
    if (world.joints.empty()) return found;
    const double dt = world.step.dt;
    const std::vector<Nodes> x = world.nodes_after(dt, v);
    for (std::size_t j = 0; j < world.joints.size(); ++j)
        if (!world.broken[j]) world.joints[j].add(x, world.time + dt, dt, found);
    ContactTerms terms;
    for (std::size_t k = 0; k < found.size(); ++k) {
        terms.add(found[k], world.first_unknown);
        Bond& bond = found[k];
        bond.difference -= dt * terms.velocity(k, v);
        if (world.config.statics) bond.law.damping = 0;
        if (bond.is_spring) continue;
        bond.law.stiffness *= world.step.velocity_factor;  // so that its whole impulse acts
        bond.law.damping *= world.step.velocity_factor;
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
        if (bond.is_spring || world.broken[bond.joint] || !(stiffness > 0)) continue;
        const double gives =
            bond.law.at(bond.difference + world.step.dt * terms.velocity(k, v)).gradient.norm() / stiffness;
        const JointBonds& joint = world.joints[bond.joint];
        if (gives > joint.most_give())
            return fmt::format(
                "joint \"{}\" gives by {:.3g} m, more than {:.3g} m: it bears too much, or contradicts another "
                "joint or a grip",
                joint.joint().name, gives, joint.most_give());
    }
    return {};
}

bool ropes_catch(const WorldState& world, const StepEquations& equations, const Eigen::VectorXd& v) {
    const auto is_cord = [](const JointBonds& joint) {
        return std::holds_alternative<CordJoint>(joint.joint().kind);
    };
    if (std::ranges::none_of(world.joints, is_cord)) return false;
    std::vector<char> pulls(world.joints.size(), 0);
    for (std::size_t k = 0; k < equations.bonds.size(); ++k)
        if (!equations.solver.bond_impulse(k, v).isZero(0)) pulls[equations.bonds[k].joint] = 1;
    struct Rope {
        double now = 0, mean = 0;  // rates of its length: at the start of the part, and in it, m/s
        double ends = 0;           // of the vector between its ends
        bool pulls = false;
    };
    const double dt = world.step.dt;
    const std::vector<Nodes> x = world.nodes_now(), after = world.nodes_after(dt, v);
    std::vector<Nodes> rates;
    for (const SteppedBody& body : world.bodies) rates.push_back(body.state.x + dt * body.state.v);
    std::vector<Rope> tendons(world.tendons.size()), ropes;
    for (std::size_t j = 0; j < world.joints.size(); ++j) {
        const auto* cord = std::get_if<CordJoint>(&world.joints[j].joint().kind);
        if (!cord || world.broken[j]) continue;
        const int tendon = world.tendon_of(static_cast<int>(j));
        if (tendon < 0 ? !cord->pulls_only || cord->stiffness > 0 : world.tendons[tendon].stiffness > 0)
            continue;
        const Eigen::Vector3d span = world.joints[j].span(x),
                              rate = (world.joints[j].span(rates) - span) / dt;
        Rope& rope = tendon < 0 ? ropes.emplace_back() : tendons[tendon];
        rope.now += rate.dot(span.normalized());
        rope.mean += (world.joints[j].span(after).norm() - span.norm()) / dt;
        rope.ends += rate.norm();
        rope.pulls = rope.pulls || pulls[j];
    }
    ropes.insert(ropes.end(), tendons.begin(), tendons.end());
    constexpr double share = 0.1, of_fall = 1e-3, of_size = 1e-9;
    const double least = std::max(of_fall * world.gravity_at(world.time).norm() * dt,
                                  of_size * world.smallest_diagonal() / dt);
    return std::ranges::any_of(ropes, [&](const Rope& rope) {
        const double off = std::abs(rope.mean - rope.now);
        return rope.pulls && off > least && off > share * std::max(std::abs(rope.mean), rope.ends);
    });
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
    return forces;
}

JointLoad JointForces::earlier(const WorldState& world, std::size_t joint) const {
    JointLoad sum;
    if (world.step.velocity_factor == 1) return sum;
    const TwoStepWeights weights(world.knows_last ? world.step.dt / world.dt_before : 1);
    const JointLoad &now = now_[joint], &before = world.knows_last ? before_[joint] : now;
    for (Momentum JointLoad::*side : {&JointLoad::on_a, &JointLoad::on_b}) {
        add(sum.*side, now.*side, world.step.dt * weights.now);
        add(sum.*side, before.*side, world.step.dt * weights.before);
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
                                const BodyPositions& middles, const BodyPositions& ends,
                                ReactionSums& reactions) const {
    const auto& [systems, contacts, bonds, solver] = equations;
    std::vector<JointLoad> sums(world.joints.size());  // impulses, about the origin
    std::vector<MeanPlace> places(world.joints.size());
    for (std::size_t k = 0; k < bonds.size(); ++k) {
        const Eigen::Vector3d impulse = solver.bond_impulse(k, v, more) / world.step.velocity_factor,
                              place = solver.bond_place(k, middles, ends);
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
            add(sum, {before.linear, before.angular + middles.centres[body].cross(before.linear)});
            reactions.add(body, ReactionBy::joint, static_cast<int>(j), rate * sum.linear, rate * sum.angular,
                          places[j]);
        };
        tell(joint.a, sums[j].on_a, begun.on_a);
        tell(joint.b, sums[j].on_b, begun.on_b);
    }
}

void JointForces::break_joints(WorldState& world, const StepEquations& equations, const Eigen::VectorXd& v) {
    const auto& [systems, contacts, bonds, solver] = equations;
    const double dt = world.step.dt;
    std::vector<Eigen::Vector3d> forces(world.joints.size(), Eigen::Vector3d::Zero());
    for (std::size_t k = 0; k < bonds.size(); ++k)
        forces[bonds[k].joint] +=
            solver.bond_impulse(k, v) / (bonds[k].is_spring ? dt : world.step.velocity_factor * dt);
    for (std::size_t j = 0; j < world.joints.size(); ++j)
        if (!world.broken[j] && forces[j].norm() > world.joints[j].joint().strength) {
            world.broken[j] = 1;
            notice(fmt::format("joint \"{}\" breaks at {:.6g} s, under {:.3g} N",
                               world.joints[j].joint().name, world.end(), forces[j].norm()));
            world.forget_rates(world.joints[j].joint());
            before_[j] = {};
        }
}

}  // namespace nbd
