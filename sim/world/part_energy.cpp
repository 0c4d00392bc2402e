// What a linearisation misses of a body's energy in a part of a step, and where that makes energy.
#include <algorithm>
#include <cmath>
#include <vector>

#include "meshing/body/rigid_body.hpp"
#include "meshing/parallel/parallel_for.hpp"
#include "sim/fem/step_system.hpp"
#include "sim/world/part_solve.hpp"
#include "sim/world/step_loads.hpp"
#include "sim/world/time_rule.hpp"

namespace nbd {
namespace {

/// Of the kinetic energy of a body and of what its elastic energy changes by, that a body may gain without a
/// reason, and that a linearisation may miss before a balance is sought.
constexpr double most_gained = 1e-3, most_missed = 0.01;
constexpr double energy_rounding = 1e-13;  // relative

}  // namespace

/// How much a rigid body at v is strained by turning along straight ways from where it was linearised: by
/// half the square of its turn, which a linearisation at v does not have. 0 of a body that deforms.
double PartSolve::strain_of_turn(int body, const Eigen::VectorXd& v) const {
    const SteppedBody& one = world_.at(body);
    if (!one.elastic->is_rigid()) return 0;
    const Nodes x = one.start.x + dt_ * world_.part_of(body, v);
    const Eigen::Matrix3d R = equations_.systems[body].elements().R[0].lane(0),
                          turn = R.transpose() * one.elastic->deformation_gradient(x, 0) -
                                 Eigen::Matrix3d::Identity();
    return (turn.transpose() * turn).norm() / 2;
}

/// The largest of all bodies.
double PartSolve::strain_of_turns(const Eigen::VectorXd& v) const {
    double largest = 0;
    for (int b = 0; b < world_.body_count(); ++b) largest = std::max(largest, strain_of_turn(b, v));
    return largest;
}

/// The kinetic energy of a body at the unknown w about its centre, or that of a fall in the step.
double PartSolve::inner_motion(int index, const Nodes& w) const {
    const ElasticBody& body = *world_.at(index).elastic;
    const Eigen::RowVector3d mean = body.node_masses().transpose() * w / body.mass();
    const double fall = body.mass() * (world_.gravity_before * dt_).squaredNorm();
    return std::max(kinetic_energy(body, w.rowwise() - mean), fall);
}

/// The elastic energy that deformable bodies that can turn get by doing so along straight ways from where
/// they are linearised at `from`, as a share of inner_motion() at `to`: of the largest of all bodies. A
/// straight way strains by half the square of the turn, which matters where sound crosses a body many times
/// in a step.
double PartSolve::share_of_turns(const Eigen::VectorXd& from, const Eigen::VectorXd& to) const {
    double largest = 0;
    for (int b = 0; b < world_.body_count(); ++b) {
        const ElasticBody& body = *world_.at(b).elastic;
        if (body.is_rigid() || !world_.can_turn(world_.at(b))) continue;
        const Nodes w = world_.part_of(b, to), x = world_.at(b).start.x + dt_ * world_.part_of(b, from);
        const Eigen::Vector3d turn = dt_ * angular_velocity(body, {.x = x, .v = w - world_.part_of(b, from)});
        const double strain = turn.squaredNorm() / 2, young = world_.at(b).contact_young,
                     volume = body.mass() / body.material().density, motion = inner_motion(b, w);
        if (motion > 0) largest = std::max(largest, young * volume * strain * strain / 2 / motion);
    }
    return largest;
}

/// The potential of a body's step at the unknown w. Loads that follow it count from `from` on.
PartSolve::BodyPotential PartSolve::potential(int index, const Nodes& from, const Nodes& w) const {
    const SteppedBody& body = world_.at(index);
    const Loads outer = outer_end_loads(world_, body);
    StepPotential own(*body.elastic, body.start, equations_.steps[index], outer,
                      equations_.systems[index].elements());
    BodyPotential result{.terms = {own.value(w)}, .elastic = own.elastic_energy()};
    result.terms.push_back(excess_work(world_, body, from, w));
    if (!body.gases.empty())
        result.terms.push_back(gas_energy(body, body.start.x + dt_ * w, world_.end()) /
                               equations_.steps[index].velocity_factor);
    if (!body.winds.empty()) result.terms.push_back(drag_energy(world_, body, w));
    return result;
}

/// The impulses at v of contacts with others and of bonds, stacked: what a body does to itself explains no
/// energy.
Eigen::VectorXd PartSolve::outer_impulses(const Eigen::VectorXd& v) const {
    Eigen::VectorXd impulses = equations_.solver.impulses(v);
    const std::vector<char> pressed = equations_.solver.pressed_bodies();
    for (int b = 0; b < world_.body_count(); ++b)
        if (!pressed[b] && !world_.is_joined(b))
            impulses.segment(world_.first_unknown[b], world_.first_unknown[b + 1] - world_.first_unknown[b])
                .setZero();
    return impulses;
}

/// Whether a body at the unknown w has more energy than the work of loads and impulses explains, seen as it
/// moved before: it comes out of nothing. impulses: see outer_impulses(). Costs little beside share_missed().
bool PartSolve::gains_energy(int index, const Nodes& w, const Eigen::VectorXd& impulses) const {
    const SteppedBody& body = world_.at(index);
    const ElasticBody& elastic = *body.elastic;
    const Eigen::VectorXd& masses = elastic.node_masses();
    const Nodes x = body.start.x + dt_ * w;
    const Eigen::RowVector3d along = masses.transpose() * body.state.v / elastic.mass();
    const Nodes way = (x - body.state.x).rowwise() - dt_ * along;
    const Loads outer = outer_end_loads(world_, body);
    double work = (masses.transpose() * way).dot(outer.gravity);
    if (outer.forces.rows() > 0) work += outer.forces.cwiseProduct(way).sum();
    if (!body.gases.empty())
        work += gas_energy(body, body.state.x, world_.end()) - gas_energy(body, x, world_.end());
    work += world_.part_of(index, impulses).cwiseProduct(way).sum() / dt_;
    if (const std::vector<int> held = world_.prescribed(body, dt_).nodes; !held.empty())
        work += holding_impulses(world_, equations_, index, w, impulses)
                    .cwiseProduct(way(held, Eigen::all))
                    .sum() /
                dt_;
    const double gained = elastic.measure(x).energy - body.energy,
                 kinetic = kinetic_energy(elastic, (body.velocity_factor * w).rowwise() - along),
                 before = kinetic_energy(elastic, body.state.v.rowwise() - along);
    return kinetic - before + gained - work > most_gained * (kinetic + std::abs(gained));
}

/// By how much the potential of a body's step changes otherwise than its linearisation at `from` has told, up
/// to `to`, as a share of inner_motion() and of what its elastic energy changes by in it. 0 of bodies that
/// gain no energy.
double PartSolve::share_missed(int index, const Eigen::VectorXd& from, const Eigen::VectorXd& to,
                               const Eigen::VectorXd& impulses) const {
    const SteppedBody& body = world_.at(index);
    const ElasticBody& elastic = *body.elastic;
    const Nodes end = world_.part_of(index, to);
    if (elastic.is_rigid() || !gains_energy(index, end, impulses)) return 0;
    const StepSystem& system = equations_.systems[index];
    Nodes w = world_.part_of(index, from);
    for (Eigen::Index i = 0; i < w.rows(); ++i)
        if (system.is_prescribed(static_cast<int>(i))) w.row(i) = end.row(i);
    const Nodes sum = end + w, change = end - w;
    const Eigen::Index size = sum.size();
    Eigen::VectorXd product(size);
    system.multiply(Eigen::Map<const Eigen::VectorXd>(sum.data(), size), product);
    const double told =
        Eigen::Map<const Eigen::VectorXd>(change.data(), size).dot(product / 2 - system.rhs());
    const BodyPotential before = potential(index, w, w), after = potential(index, w, end);
    double missed = -told, size_of_terms = before.elastic;
    for (std::size_t i = 0; i < before.terms.size(); ++i) {
        missed += after.terms[i] - before.terms[i];
        size_of_terms += std::abs(before.terms[i]) + std::abs(after.terms[i]);
    }
    missed = body.velocity_factor * std::abs(missed);
    // Stiffness is in single precision, and sees how nodes move about their mean. Rounded positions are
    // strained, too.
    const Eigen::RowVector3d mean = elastic.node_masses().transpose() * sum / elastic.mass();
    double of_stiffness = 0;  // squared
    for (Eigen::Index i = 0; i < change.rows(); ++i)
        of_stiffness += std::pow(
            system.matrix().diagonal()[i].norm() * change.row(i).norm() * (sum.row(i) - mean).norm(), 2);
    const double strain =
                     energy_rounding * (1 + body.state.x.cwiseAbs().maxCoeff() / body.shape->rest_diagonal),
                 of_rounding =
                     0x1p-22 * std::sqrt(of_stiffness) +
                     energy_rounding * (size_of_terms + elastic.mass() * mean.norm() * change.norm()) +
                     body.contact_young * elastic.mass() / elastic.material().density * strain * strain;
    const double gained = after.elastic - body.energy;
    return missed > of_rounding ? missed / (inner_motion(index, end) + std::abs(gained)) : 0;
}

/// Whether a linearisation at `from` misses so much of the energy of a body at `to` that this makes energy.
bool PartSolve::misses_energy(const Eigen::VectorXd& from, const Eigen::VectorXd& to) const {
    const Eigen::VectorXd impulses = outer_impulses(to);
    std::vector<char> misses(world_.bodies.size(), 0);
    parallel_for(
        world_.body_count(), [&](int b) { misses[b] = share_missed(b, from, to, impulses) > most_missed; },
        1);
    return std::ranges::find(misses, 1) != misses.end();
}

/// Whether a body that deforms gains energy at v.
bool PartSolve::makes_energy(const Eigen::VectorXd& v) const {
    const Eigen::VectorXd impulses = outer_impulses(v);
    std::vector<char> gains(world_.bodies.size(), 0);
    parallel_for(
        world_.body_count(),
        [&](int b) {
            gains[b] = !world_.at(b).elastic->is_rigid() && gains_energy(b, world_.part_of(b, v), impulses);
        },
        1);
    return std::ranges::find(gains, 1) != gains.end();
}

}  // namespace nbd
