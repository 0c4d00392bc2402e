// The joints of a world: their bonds in a step, and where these break.
#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <utility>

#include "collision/base/notice.hpp"
#include "sim/world/world.hpp"

namespace nbd {
namespace {

void add(Momentum& sum, const Momentum& more, double times = 1) {
    sum.linear += times * more.linear;
    sum.angular += times * more.angular;
}

}  // namespace

int World::add_joint(Joint joint) {
    check_joint(joint, body_count());
    holds_.resize(bodies_.size());
    std::vector<const ElasticBody*> elastic;
    double size = at(joint.a).shape->rest_diagonal;
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
        elastic.push_back(bodies_[b].elastic.get());
        const int body = static_cast<int>(b);
        if (body != joint.a && body != joint.b) continue;
        size = std::min(size, bodies_[b].shape->rest_diagonal);
        for (std::size_t c = 0; c < b && !holds_[b]; ++c)
            if (bodies_[c].elastic == bodies_[b].elastic) holds_[b] = holds_[c];
        if (!holds_[b]) holds_[b] = std::make_shared<const NodeHold>(node_hold(*bodies_[b].elastic));
    }
    const int index = joint_count();
    JointBonds bonds(std::move(joint), index, elastic, nodes_now(), holds_, size);
    const Joint& made = bonds.joint();
    const bool meet = made.b < 0 || made.bodies_meet || std::holds_alternative<CordJoint>(made.kind);
    if (!meet) {
        PairRule rule = pairs_.of(made.a, made.b);
        rule.meets = false;
        set_pair(made.a, made.b, rule);
    }
    forget_rates(made);
    joints_.push_back(std::move(bonds));
    broken_.push_back(0);
    springs_before_.emplace_back();
    return index;
}

/// Lets the next step know nothing of the rates before it: the forces of a joint begin or end.
void World::forget_rates(const Joint& joint) {
    for (const int body : {joint.a, joint.b})
        if (body >= 0) at(body).before.reset();
}

bool World::is_joined(int body) const {
    return std::ranges::any_of(
        joints_, [&](const JointBonds& bonds) { return bonds.joint().a == body || bonds.joint().b == body; });
}

std::vector<Eigen::Vector3d> World::centres_of(std::span<const Nodes> x) const {
    std::vector<Eigen::Vector3d> centres;
    for (std::size_t b = 0; b < bodies_.size(); ++b)
        centres.push_back(centre_of_mass(*bodies_[b].elastic, x[b]));
    return centres;
}

/// Sets the bonds of a step of length dt as seen from its iterate v.
void World::find_bonds(double dt, const Eigen::VectorXd& v) {
    bonds_.clear();
    if (joints_.empty()) return;
    const std::vector<Nodes> x = nodes_after(dt, v);
    for (std::size_t j = 0; j < joints_.size(); ++j)
        if (!broken_[j]) joints_[j].add(x, time_ + dt, dt, bonds_);
    ContactTerms terms;
    for (std::size_t k = 0; k < bonds_.size(); ++k) {
        terms.add(bonds_[k], first_unknown_);
        Bond& bond = bonds_[k];
        bond.difference -= dt * terms.velocity(k, v);
        if (config_.statics) bond.law.damping = 0;
        if (bond.is_spring) continue;
        bond.law.stiffness *= step_.velocity_factor;  // so that its whole impulse acts
        bond.law.damping *= step_.velocity_factor;
    }
    if (!tendons_.empty()) find_tensions(dt);
}

/// Forces of the springs of joints on the nodes of each body where these are now, newtons. Sets springs_. dt:
/// length of the step that begins.
std::vector<Nodes> World::joint_forces(double dt) {
    std::vector<Nodes> forces;
    for (const Body& body : bodies_)
        forces.push_back(Nodes::Zero(joints_.empty() ? 0 : body.state.x.rows(), 3));
    springs_.assign(joints_.size(), {});
    if (joints_.empty()) return forces;
    BodyPositions at{.x = nodes_now(), .centres = {}};
    at.centres = centres_of(at.x);
    std::vector<Bond> bonds;
    for (std::size_t j = 0; j < joints_.size(); ++j)
        if (!broken_[j]) joints_[j].add(at.x, time_, dt, bonds);
    std::erase_if(bonds, [](const Bond& bond) { return !bond.is_spring; });
    ContactTerms terms;
    for (std::size_t k = 0; k < bonds.size(); ++k) {
        const Bond& bond = bonds[k];
        terms.add(bond, first_unknown_);
        Eigen::Vector3d u = Eigen::Vector3d::Zero();
        for (const CouplingTerm& t : terms.of(k))
            u += t.weight * bodies_[t.body].state.v.row(t.node).transpose();
        const BondLaw::Terms law = bond.law.at(bond.difference);
        const Eigen::Vector3d force = -law.gradient - law.drag * u;
        for (const CouplingTerm& t : terms.of(k)) forces[t.body].row(t.node) += t.weight * force.transpose();
        std::vector<Momentum> loads(bodies_.size());
        terms.add_momentum(k, force, at, loads);
        add(springs_[bond.joint].on_a, loads[bond.a.body]);
        if (bond.b.body >= 0) add(springs_[bond.joint].on_b, loads[bond.b.body]);
    }
    return forces;
}

/// What the springs of a joint have added to the step by their forces before its end, impulses.
JointLoad World::earlier_springs(std::size_t joint) const {
    JointLoad sum;
    if (step_.velocity_factor == 1) return sum;
    const TwoStepWeights weights(knows_last_ ? step_.dt / dt_before_ : 1);
    const JointLoad &now = springs_[joint], &before = knows_last_ ? springs_before_[joint] : now;
    for (Momentum JointLoad::*side : {&JointLoad::on_a, &JointLoad::on_b}) {
        add(sum.*side, now.*side, step_.dt * weights.now);
        add(sum.*side, before.*side, step_.dt * weights.before);
    }
    return sum;
}

Momentum World::earlier_springs_on(int body) const {
    Momentum sum;
    for (std::size_t j = 0; j < joints_.size(); ++j) {
        const Joint& joint = joints_[j].joint();
        if (joint.a != body && joint.b != body) continue;
        const JointLoad earlier = earlier_springs(j);
        add(sum, joint.a == body ? earlier.on_a : earlier.on_b);
    }
    return sum;
}

/// Adds what joints did to their bodies in a part. more: impulses of a response, of each contact and bond.
void World::add_joint_reactions(const StepPart& part, const Eigen::VectorXd& v,
                                std::span<const Eigen::Vector3d> more, const BodyPositions& middles,
                                const BodyPositions& ends) {
    const double rate = part.share / part.dt;
    std::vector<JointLoad> sums(joints_.size());  // impulses, about the origin
    std::vector<MeanPlace> places(joints_.size());
    for (std::size_t k = 0; k < bonds_.size(); ++k) {
        const Eigen::Vector3d impulse = solver_.bond_impulse(k, v, more) / step_.velocity_factor,
                              place = solver_.bond_place(k, middles, ends);
        JointLoad& sum = sums[bonds_[k].joint];
        const Momentum on_a{impulse, place.cross(impulse)};
        places[bonds_[k].joint].add(place, rate * impulse.norm());
        add(sum.on_a, on_a);
        add(sum.on_b, on_a, -1);
    }
    for (std::size_t j = 0; j < joints_.size(); ++j) {
        if (broken_[j]) continue;
        const Joint& joint = joints_[j].joint();
        const JointLoad earlier = earlier_springs(j);
        const auto tell = [&](int body, Momentum sum, const Momentum& before) {
            if (body < 0) return;
            add(sum, {before.linear, before.angular + middles.centres[body].cross(before.linear)});
            reactions_.add(body, ReactionBy::joint, static_cast<int>(j), rate * sum.linear,
                           rate * sum.angular, places[j]);
        };
        tell(joint.a, sums[j].on_a, earlier.on_a);
        tell(joint.b, sums[j].on_b, earlier.on_b);
    }
}

/// Breaks the joints whose force in the part is more than they bear. v: the solution of the part.
void World::break_joints(double dt, const Eigen::VectorXd& v) {
    std::vector<Eigen::Vector3d> forces(joints_.size(), Eigen::Vector3d::Zero());
    for (std::size_t k = 0; k < bonds_.size(); ++k)
        forces[bonds_[k].joint] +=
            solver_.bond_impulse(k, v) / (bonds_[k].is_spring ? dt : step_.velocity_factor * dt);
    for (std::size_t j = 0; j < joints_.size(); ++j)
        if (!broken_[j] && forces[j].norm() > joints_[j].joint().strength) {
            broken_[j] = 1;
            notice(fmt::format("joint \"{}\" breaks at {:.6g} s, under {:.3g} N", joints_[j].joint().name,
                               time_ + dt, forces[j].norm()));
            forget_rates(joints_[j].joint());
            springs_before_[j] = {};
        }
}

/// Which joint is not what it should be at the end of a part; empty: none. v: its solution.
std::string World::joint_fault(double dt, const Eigen::VectorXd& v) const {
    ContactTerms terms;
    for (std::size_t k = 0; k < bonds_.size(); ++k) {
        const Bond& bond = bonds_[k];
        terms.add(bond, first_unknown_);
        const double stiffness =
            std::max(bond.law.stiffness, bond.law.K.selfadjointView<Eigen::Lower>().operatorNorm());
        if (bond.is_spring || broken_[bond.joint] || !(stiffness > 0)) continue;
        const double gives =
            bond.law.at(bond.difference + dt * terms.velocity(k, v)).gradient.norm() / stiffness;
        const JointBonds& joint = joints_[bond.joint];
        if (gives > joint.most_give())
            return fmt::format(
                "joint \"{}\" gives by {:.3g} m, more than {:.3g} m: it bears too much, or contradicts another "
                "joint or a grip",
                joint.joint().name, gives, joint.most_give());
    }
    return {};
}

}  // namespace nbd
