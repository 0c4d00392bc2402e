// One part of a step: Newton's iteration over bodies that a barrier keeps apart.
#include "sim/world/part_solve.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "collision/base/stop.hpp"
#include "collision/base/stopwatch.hpp"
#include "meshing/body/rigid_body.hpp"
#include "meshing/parallel/parallel_for.hpp"
#include "sim/fem/step_system.hpp"
#include "sim/world/given_ways.hpp"
#include "sim/world/joint_forces.hpp"
#include "sim/world/step_loads.hpp"
#include "sim/world/time_rule.hpp"

namespace nbd {
namespace {

constexpr int max_linearisations = 30;  // unless the step's config allows several itself
constexpr int firm_linearisations = 8;  // in which a balance is sought as if it were asked for
/// Of a body's impulses, by which those of contacts may be off. Where these change from feature to feature
/// with every linearisation they come no nearer, so that each allows twice as much as the one before.
constexpr double contact_share = 0.1;
/// Of the kinetic energy of a body, which turning may give it in elastic energy; likewise.
constexpr double turns_share = 1e-5;
constexpr double first_gas_error = 1e-3;     // of absolute pressures, likewise
constexpr double first_follow_error = 0.01;  // of the forces of loads that follow, likewise
constexpr double first_drag_error = 0.02;    // of what winds do, likewise
constexpr int max_halvings = 40;             // of a Newton step, until the potential falls
constexpr double rounding = 1e-13;           // relative, of potentials
constexpr double least_progress = 1e-9;      // share of a Newton step that counts as motion

/// Whether positions at the end of a step can be told in single precision.
bool leads_somewhere(double dt, const Eigen::VectorXd& v) {
    constexpr double farthest = 1e18;  // metres; its square is still finite
    return v.size() == 0 || (v.allFinite() && dt * v.cwiseAbs().maxCoeff() < farthest);
}

std::string out_of_balance(double error, double allowed) {
    return fmt::format("impulses out of balance by {:.2g} of those on a body, allowed: {:.2g}", error,
                       allowed);
}

/// Which obstacles turn, grow or deform in a part, and bodies on them with them.
std::vector<char> turning_obstacles(const WorldState& world) {
    const double begin = world.time, end = world.end();
    std::vector<char> turning;
    for (const Obstacle& obstacle : world.obstacles) {
        const Keyframe now = obstacle.motion.keyframe_at(begin), then = obstacle.motion.keyframe_at(end);
        turning.push_back(now.rotation != then.rotation || now.scale != then.scale ||
                          (obstacle.frames && !obstacle.frames->stand(begin, end)));
    }
    return turning;
}

}  // namespace

/// A hundred-thousandth of the smallest body: nobody sees that friction gives by as much before it slides. Or
/// a thousandth of a fall from rest, where steps are long: a stiffer spring would be settled by no iteration.
double PartSolve::slip_length() const noexcept {
    if (world_.config.statics) return 1e-5 * world_.smallest_diagonal();
    double gravity = world_.config.gravity.norm();
    for (const Eigen::Vector3d& value : world_.config.gravity_keys.values)
        gravity = std::max(gravity, value.norm());
    return std::max(1e-5 * world_.smallest_diagonal(), 1e-3 * gravity * dt_ * dt_);
}

/// Velocities that lead from where the bodies are to where their steps start, stacked; see TimeStep.
Eigen::VectorXd PartSolve::leads() const {
    Eigen::VectorXd leads = Eigen::VectorXd::Zero(world_.first_unknown.back());
    for (std::size_t b = 0; b < world_.bodies.size(); ++b)
        Eigen::Map<Nodes>(leads.data() + world_.first_unknown[b], world_.bodies[b].state.x.rows(), 3) =
            (world_.bodies[b].start.x - world_.bodies[b].state.x) / dt_;
    return leads;
}

/// Whether nodes end elsewhere than they are because their velocities are given: beyond rounding.
bool PartSolve::held_nodes_move(const std::vector<PrescribedNodes>& given) const {
    constexpr double unit = 8 * std::numeric_limits<double>::epsilon();
    for (std::size_t b = 0; b < world_.bodies.size(); ++b)
        for (std::size_t k = 0; k < given[b].nodes.size(); ++k) {
            const int node = given[b].nodes[k];
            const auto now = world_.bodies[b].state.x.row(node);
            const Eigen::RowVector3d end = world_.bodies[b].start.x.row(node) + dt_ * given[b].v.row(k);
            if ((end - now).norm() > unit * (now.norm() + dt_ * given[b].v.row(k).norm())) return true;
        }
    return false;
}

/// Contacts of the iterate v, after a share of the motion proposed last, with the gaps that linear motion
/// from the start of the step would have. progress: how far obstacles have come.
std::vector<Contact> PartSolve::contacts_at(const Eigen::VectorXd& v, double share, double progress,
                                            std::span<const ContactShape* const> shapes) {
    std::vector<Contact> contacts = barrier_.contacts(share);
    const Eigen::VectorXd lead = leads();
    const double slip = slip_length();
    ContactTerms terms;
    for (std::size_t c = 0; c < contacts.size(); ++c) {
        Contact& contact = contacts[c];
        terms.add(contact, shapes, world_.first_unknown);
        const Eigen::Vector3d led = terms.velocity(c, lead),
                              moved = terms.velocity(c, v) + led - progress * contact.wall_velocity;
        contact.gap -= dt_ * contact.normal.dot(moved);
        contact.wall_velocity -= led;
        friction_.recall(contact, slip);
    }
    return contacts;
}

/// By how much contacts at v, the end of the motion proposed last, press otherwise than was solved for, as a
/// share of the impulses on a body.
double PartSolve::contact_error(const Eigen::VectorXd& v, std::span<const ContactShape* const> shapes) {
    const std::vector<Contact> contacts = barrier_.contacts(1);
    ContactTerms terms;
    for (const Contact& contact : contacts) terms.add(contact, shapes, world_.first_unknown);
    terms.hold(equations_.systems);
    Eigen::VectorXd error = -equations_.solver.normal_impulses(v);
    for (std::size_t c = 0; c < contacts.size(); ++c) {
        const Contact& contact = contacts[c];
        terms.add_impulse(c, -dt_ * contact.barrier.at(contact.gap).slope * contact.normal, false, error);
    }
    return equations_.solver.share_of_scales(error, Eigen::VectorXd::Zero(v.size()));
}

/// The share of the motion from v to `to` in which no body deforms by more than its own size. Where passes do
/// not settle, a motion may be far beyond that, and near everything.
double PartSolve::trusted_share(const Eigen::VectorXd& v, const Eigen::VectorXd& to) const {
    double share = 1;
    const Eigen::VectorXd change = to - v;
    for (int b = 0; b < world_.body_count(); ++b) {
        const Nodes way = dt_ * world_.part_of(b, change);
        const Eigen::RowVector3d mean = way.colwise().mean();
        const double most = (way.rowwise() - mean).rowwise().norm().maxCoeff();
        if (const double allowed = world_.at(b).shape->rest_diagonal; most > allowed)
            share = std::min(share, allowed / most);
    }
    return std::min(share, share_of_cavities(world_, v, to));
}

/// Whether bodies at v, to which the first linearisation of a part leads, would make energy or throw what is
/// caught if they go on by what was before. They begin the part anew then, by backward Euler.
bool PartSolve::goes_on_abruptly(const Eigen::VectorXd& v) {
    std::vector<char> abrupt = caught_bodies(world_, equations_, v);
    add_joined(world_, abrupt);
    for (std::size_t b = 0; b < abrupt.size(); ++b) caught_[b] = caught_[b] || abrupt[b];
    const std::vector<char> pressed = equations_.solver.pressed_bodies();
    for (int b = 0; b < world_.body_count(); ++b)
        if (world_.at(b).velocity_factor > 1 && (pressed[b] || world_.is_joined(b)) &&
            strain_of_turn(b, v) > rigid_strain)
            abrupt[b] = 1;
    add_joined(world_, abrupt);
    return take_backward_euler(world_, abrupt);
}

/// A part with contacts linearised at its start. Where they lead nowhere near an intersection and press at
/// the end as was solved for, it is done. If not, it goes as far as nothing collides, and is
/// linearised there. v: out, the velocities at the end of the part.
Rejection PartSolve::solve(Eigen::VectorXd& v, WorldReport& report) {
    std::vector<const ContactShape*>& shapes = equations_.shapes;
    shapes.clear();
    std::vector<PrescribedNodes> given;
    for (const SteppedBody& body : world_.bodies) {
        shapes.push_back(body.shape.get());
        given.push_back(world_.prescribed(body, dt_));
    }
    // One linearisation stretches a body that turns, which friction on an obstacle that turns it holds back.
    // A balance is sought then, too, but less and less of one. Where a linearisation makes energy, it is
    // sought until none is made.
    const bool is_asked = world_.config.step.newton_iterations > 1;
    bool is_newton = is_asked, begins = true;
    const std::vector<char> turning = turning_obstacles(world_);
    Tangent tangent = world_.config.step.tangent;
    const int most = is_asked ? world_.config.step.newton_iterations : max_linearisations;
    report.solver_converged = true;
    is_abrupt_ = false;
    fell_short_of_.resize(0);
    equations_.steps = world_.steps();
    barrier_.begin_step(world_.time, dt_);
    Eigen::VectorXd to = stacked(&likely_velocities, given);
    v = -leads();
    GivenWays given_ways(barrier_.obstacles_move() || held_nodes_move(given));
    constexpr const char* too_large = "the velocities of the step are too large, or not finite";
    if (!leads_somewhere(dt_, to)) return {.reason = too_large, .fatal = true};
    look(v, to, given_ways.obstacles, report);
    const Eigen::VectorXd first = stacked(&first_iterate, given);
    Eigen::VectorXd linearised_at = first;
    double share = 0, moved = 0;
    std::string left_open;
    double allowed_strain = rigid_strain, allowed_turns = turns_share, allowed_of_loads = first_follow_error,
           allowed_of_gases = first_gas_error, allowed_of_winds = first_drag_error;
    double allowed = is_asked ? world_.config.step.newton_tolerance : contact_share;
    int firm_up_to = -1;  // linearisations, of a balance that makes no energy
    const auto seek_balance = [&] {
        is_newton = begins = equations_.are_balanced = true;
        allowed = world_.config.step.newton_tolerance;
    };
    for (int k = 0;; ++k) {
        stop_if_asked();
        timed(report.detect_us, "detect",
              [&] { equations_.contacts = contacts_at(v, share, given_ways.obstacles, shapes); });
        find_bonds(v);
        if (!is_newton && std::ranges::any_of(equations_.contacts, [&](const Contact& contact) {
                return contact.obstacle >= 0 && turning[contact.obstacle];
            })) {
            seek_balance();
        }
        const bool begun = std::exchange(begins, false);
        timed(report.solve_us, "solve", [&] {
            if (begun)
                equations_.solver.begin(equations_.contacts, equations_.bonds, shapes, world_.first_unknown,
                                        world_.config.contact.tolerance, equations_.steps, first, is_newton);
            else
                equations_.solver.set_contacts(equations_.contacts, equations_.bonds, v);
        });
        if (is_newton && !begun && given_ways.are_gone()) {
            const double error = residual(v);
            const bool is_firm = firm_up_to >= 0;
            if (error <= allowed ||
                (is_firm && k >= firm_up_to && error <= contact_share && !makes_energy(v))) {
                fell_short_of_.resize(0);
                return {};
            }
            left_open = out_of_balance(error, allowed);
            if (!is_asked && !is_firm) allowed *= 2;
            if (is_firm && k >= 2 * firm_up_to) break;
        }
        if (k == most || (k > 0 && share < least_progress)) break;
        if (k > 0) linearised_at = v;
        timed(report.assemble_us, "assemble", [&] { build_systems(given, k > 0 ? &v : nullptr, tangent); });
        const ContactSolveReport solved =
            timed(report.solve_us, "solve", [&] { return tendons_.solve(world_, equations_, gases_, to); });
        if (!solved.fallback.empty())
            report.fallback = fmt::format("at {:.6g} s: {}", world_.end(), solved.fallback);
        report.contacts = solved.active;
        report.solver_converged = report.solver_converged && solved.converged;
        report.contacts_settled = solved.settled;
        ++report.newton_iterations;
        report.solver_iterations += solved.linear_iterations;
        if (!leads_somewhere(dt_, to)) return {.reason = too_large, .fatal = true};
        if (k == 0 && goes_on_abruptly(to)) {
            is_abrupt_ = true;
            return {.reason = "a body turns abruptly, or is caught"};
        }
        const double turned = is_newton ? 0 : share_of_turns(linearised_at, to),
                     follow_off = is_newton ? 0 : follow_error(world_, to);
        if (!is_newton && turned <= allowed_turns && follow_off <= allowed_of_loads &&
            misses_energy(linearised_at, to)) {
            seek_balance();
            firm_up_to = k + firm_linearisations;
            if (tangent == Tangent::rotated) tangent = Tangent::full;
        }
        fell_short_of_ = to;
        const double trusted = trusted_share(v, to);
        if (trusted < 1) to = v + trusted * (to - v);
        share = propose(v, to, given_ways.obstacles, report);
        if (share == 1 && trusted == 1) fell_short_of_.resize(0);
        if (share == 1 && trusted == 1 && !is_newton) {
            const double error = timed(report.detect_us, "detect", [&] { return contact_error(to, shapes); });
            left_open.clear();
            if (error > allowed)
                left_open = out_of_balance(error, allowed);
            else if (!solved.settled)
                left_open = "contacts that press and let go in turn";
            else if (strain_of_turns(to) > allowed_strain)
                left_open = "a rigid body that turns too far";
            else if (turned > allowed_turns)
                left_open =
                    "a body that turns too far in a step for how stiff it is; it may as well be rigid";
            else if (follow_off > allowed_of_loads)
                left_open = "loads that follow a body which moves too far";
            else if (gases_.error(world_, to) > allowed_of_gases)
                left_open = "gases whose pressures do not fit their volumes";
            else if (drag_error(world_, to) > allowed_of_winds)
                left_open = "winds whose drag does not fit the motion";
            if (left_open.empty()) {
                v = to;
                if (solved.converged) return {};
                return {.reason = "the linear system was not solved to its tolerance",
                        .trouble = StepTrouble::linear_solver};
            }
            if (error > allowed) allowed *= 2;
            allowed_strain *= 2;
            allowed_turns = std::min(2 * allowed_turns, 1.0);
            allowed_of_loads *= 2;
            allowed_of_gases *= 2;
            allowed_of_winds *= 2;
        }
        if ((k > 0 || begins) && given_ways.are_gone()) share = search_line(v, to, share);
        v += share * (to - v);
        to = v;
        given_ways.go(share, trusted);
        moved = std::max(moved, share);
    }
    if (!given_ways.are_gone()) return {.reason = given_ways.text(), .fatal = true};
    if (moved < least_progress) return {.reason = "the step finds no progress", .fatal = true};
    if (left_open.empty()) left_open = "linearisations that lead too far, or into contacts";
    return {.reason = "Newton's iteration ends with " + left_open, .trouble = StepTrouble::newton};
}

/// What comes near in the motion from v to `to`.
void PartSolve::look(const Eigen::VectorXd& v, const Eigen::VectorXd& to, double progress,
                     WorldReport& report) {
    const ScopedTimer timer(report.detect_us, "detect");
    barrier_.look(world_.nodes_after(dt_, v), world_.nodes_after(dt_, to), progress);
    report.add(barrier_.costs());
}

/// The share of the motion from v to `to` that is free of collisions.
double PartSolve::propose(const Eigen::VectorXd& v, const Eigen::VectorXd& to, double progress,
                          WorldReport& report) {
    const ScopedTimer timer(report.detect_us, "detect");
    const double share = barrier_.move(world_.nodes_after(dt_, v), world_.nodes_after(dt_, to), progress);
    report.add(barrier_.costs());
    return share;
}

/// The largest of share, share / 2, share / 4 ... at which the potential of the step is no higher than at v,
/// as far as rounding lets one tell. The way to `to` leads downwards: it lowers the quadratic model of the
/// linearisation, whose matrix is positive definite.
double PartSolve::search_line(const Eigen::VectorXd& v, const Eigen::VectorXd& to, double share) {
    const auto potentials = [&](double s) {  // of the barrier, friction and each body
        const Eigen::VectorXd at_s = v + s * (to - v);
        // Of statics for the normal forces at v, as their solves have them.
        std::vector<double> terms{barrier_.energy(s),
                                  equations_.solver.friction_potential(at_s, world_.config.statics ? v : to),
                                  equations_.solver.bond_potential(at_s)};
        for (int b = 0; b < world_.body_count() && std::isfinite(terms.front()); ++b) {
            const BodyPotential body = potential(b, world_.part_of(b, v), world_.part_of(b, at_s));
            terms.insert(terms.end(), body.terms.begin(), body.terms.end());
        }
        return terms;
    };
    const std::vector<double> before = potentials(0);
    for (int k = 0; k < max_halvings; ++k, share /= 2) {
        const std::vector<double> after = potentials(share);
        if (!std::isfinite(after.front())) continue;
        double change = 0, size = 0;
        for (std::size_t i = 0; i < before.size(); ++i) {
            change += after[i] - before[i];
            size += std::abs(before[i]);
        }
        if (change <= rounding * size) return share;
    }
    return 0;
}

/// Why the end of a part must not be kept; empty: nothing intersects, nor has come too near for the next part
/// since bounds missed it.
std::string PartSolve::end_fault(const Eigen::VectorXd& v, WorldReport& report) {
    const ScopedTimer timer(report.detect_us, "detect");
    report.least_distance = barrier_.least_distance();  // the contacts at v were found last
    const std::vector<Intersection> found = barrier_.intersections(world_.nodes_after(dt_, v));
    if (!found.empty()) return intersection_text(found, barrier_.surfaces());
    return barrier_.missed_too_near() ? "surfaces are too near for the next one" : "";
}

Rejection PartSolve::run(Eigen::VectorXd& v, WorldReport& report) {
    caught_.assign(world_.bodies.size(), 0);
    for (;;) {
        equations_.are_balanced = world_.config.step.newton_iterations > 1;
        Rejection rejection = world_.config.statics ? balance(v, report) : solve(v, report);
        if (is_abrupt_) {
            tendons_.begin(world_.tendons.size());
            continue;
        }
        if (rejection && (!part_.finest || rejection.is_final)) return rejection;
        if (!rejection.fatal) {
            const std::string fault = end_fault(v, report);
            if (fault.empty()) return rejection;
            rejection = {.reason = "the step would end where " + fault, .fatal = true};
        }
        if (!barrier_.can_miss()) return rejection;
        ++report.exact_parts;
        barrier_.be_exact(true);
    }
}

}  // namespace nbd
