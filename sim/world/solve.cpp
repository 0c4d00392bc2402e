// One part of a step: Newton's iteration over bodies that a barrier keeps apart.
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
#include "sim/fem/step_system.hpp"
#include "sim/world/given_ways.hpp"
#include "sim/world/world.hpp"

namespace nbd {
namespace {

constexpr int max_linearisations = 30;  // unless the step's config allows several itself
/// Of a body's impulses, by which those of contacts may be off. Where these change from feature to feature
/// with every linearisation they come no nearer, so that each allows twice as much as the one before.
constexpr double contact_share = 0.1;
/// Of the kinetic energy of a body, which turning may give it in elastic energy; likewise.
constexpr double turns_share = 1e-3;
constexpr double least_gas_error = 1e-3;   // of absolute pressures, likewise
constexpr double least_drag_error = 0.02;  // of what winds do, likewise
constexpr int max_halvings = 40;           // of a Newton step, until the potential falls
constexpr double rounding = 1e-13;         // relative, of potentials
constexpr double least_progress = 1e-9;    // share of a Newton step that counts as motion

/// Whether positions at the end of a step can be told in single precision.
bool leads_somewhere(double dt, const Eigen::VectorXd& v) {
    constexpr double farthest = 1e18;  // metres; its square is still finite
    return v.size() == 0 || (v.allFinite() && dt * v.cwiseAbs().maxCoeff() < farthest);
}

std::string out_of_balance(double error, double allowed) {
    return fmt::format("impulses out of balance by {:.2g} of those on a body, allowed: {:.2g}", error,
                       allowed);
}

/// Whether an obstacle turns, grows or deforms between two times, and bodies on it with it.
bool turns(std::span<const Obstacle> obstacles, double begin, double end) {
    return std::ranges::any_of(obstacles, [&](const Obstacle& obstacle) {
        const Keyframe now = obstacle.motion.keyframe_at(begin), then = obstacle.motion.keyframe_at(end);
        return now.rotation != then.rotation || now.scale != then.scale ||
               (obstacle.frames && !obstacle.frames->stand(begin, end));
    });
}

}  // namespace

std::vector<Nodes> World::nodes_now() const {
    std::vector<Nodes> nodes;
    for (const Body& body : bodies_) nodes.push_back(body.state.x);
    return nodes;
}

std::vector<Intersection> World::intersecting_faces() {
    barrier().begin_step(time_, 0);
    return barrier().intersections(nodes_now());
}

std::vector<Intersection> World::touching_at_rest() { return barrier().touching_at_rest(); }

/// Velocities that lead from where the bodies are to where their steps start, stacked; see TimeStep.
Eigen::VectorXd World::leads(double dt) const {
    Eigen::VectorXd leads = Eigen::VectorXd::Zero(first_unknown_.back());
    for (std::size_t b = 0; b < bodies_.size(); ++b)
        Eigen::Map<Nodes>(leads.data() + first_unknown_[b], bodies_[b].state.x.rows(), 3) =
            (bodies_[b].start.x - bodies_[b].state.x) / dt;
    return leads;
}

/// Whether nodes end elsewhere than they are because their velocities are given: beyond rounding.
bool World::held_nodes_move(double dt, const std::vector<PrescribedNodes>& given) const {
    constexpr double unit = 8 * std::numeric_limits<double>::epsilon();
    for (std::size_t b = 0; b < bodies_.size(); ++b)
        for (std::size_t k = 0; k < given[b].nodes.size(); ++k) {
            const int node = given[b].nodes[k];
            const auto now = bodies_[b].state.x.row(node);
            const Eigen::RowVector3d end = bodies_[b].start.x.row(node) + dt * given[b].v.row(k);
            if ((end - now).norm() > unit * (now.norm() + dt * given[b].v.row(k).norm())) return true;
        }
    return false;
}

/// Contacts of the iterate v, after a share of the motion proposed last, with the gaps that linear motion
/// from the start of the step would have. progress: how far obstacles have come.
std::vector<Contact> World::contacts_at(double dt, const Eigen::VectorXd& v, double share, double progress,
                                        std::span<const ContactShape* const> shapes) {
    std::vector<Contact> contacts = barrier().contacts(share);
    const Eigen::VectorXd lead = leads(dt);
    ContactTerms terms;
    for (std::size_t c = 0; c < contacts.size(); ++c) {
        Contact& contact = contacts[c];
        terms.add(contact, shapes, first_unknown_);
        const Eigen::Vector3d led = terms.velocity(c, lead),
                              moved = terms.velocity(c, v) + led - progress * contact.wall_velocity;
        contact.gap -= dt * contact.normal.dot(moved);
        contact.wall_velocity -= led;
        friction_memory_.recall(contact, slip_length(dt));
    }
    return contacts;
}

/// By how much contacts at v, the end of the motion proposed last, press otherwise than was solved for, as a
/// share of the impulses on a body.
double World::contact_error(double dt, const Eigen::VectorXd& v,
                            std::span<const ContactShape* const> shapes) {
    const std::vector<Contact> contacts = barrier().contacts(1);
    ContactTerms terms;
    for (const Contact& contact : contacts) terms.add(contact, shapes, first_unknown_);
    terms.hold(systems_);
    Eigen::VectorXd error = -solver_.normal_impulses(v);
    for (std::size_t c = 0; c < contacts.size(); ++c) {
        const Contact& contact = contacts[c];
        terms.add_impulse(c, -dt * contact.barrier.at(contact.gap).slope * contact.normal, false, error);
    }
    return solver_.share_of_scales(error, Eigen::VectorXd::Zero(v.size()));
}

/// The share of the motion from v to `to` in which no body deforms by more than its own size. Where passes do
/// not settle, a motion may be far beyond that, and near everything.
double World::trusted_share(double dt, const Eigen::VectorXd& v, const Eigen::VectorXd& to) const {
    double share = 1;
    for (int b = 0; b < body_count(); ++b) {
        const Nodes way = dt * body_part(b, to - v);
        const Eigen::RowVector3d mean = way.colwise().mean();
        const double most = (way.rowwise() - mean).rowwise().norm().maxCoeff();
        if (const double allowed = at(b).shape->rest_diagonal; most > allowed)
            share = std::min(share, allowed / most);
    }
    return std::min(share, share_of_cavities(dt, v, to));
}

/// How much a rigid body at v is strained by turning along straight ways from where it was linearised: by
/// half the square of its turn, which a linearisation at v does not have. The largest of all bodies.
double World::strain_of_turns(double dt, const Eigen::VectorXd& v) const {
    double largest = 0;
    for (int b = 0; b < body_count(); ++b) {
        if (!elastic(b).is_rigid()) continue;
        const Nodes x = at(b).start.x + dt * body_part(b, v);
        const Eigen::Matrix3d R = systems_[b].elements().R[0].lane(0),
                              turn = R.transpose() * elastic(b).deformation_gradient(x, 0) -
                                     Eigen::Matrix3d::Identity();
        largest = std::max(largest, (turn.transpose() * turn).norm() / 2);
    }
    return largest;
}

/// The elastic energy that deformable bodies that nothing holds get by turning along straight ways from where
/// they are linearised at `from`, as a share of their kinetic energy at `to`: of the largest of all bodies. A
/// straight way strains by half the square of the turn, which matters where sound crosses a body many times
/// in a step.
double World::share_of_turns(double dt, const Eigen::VectorXd& from, const Eigen::VectorXd& to) const {
    double largest = 0;
    for (int b = 0; b < body_count(); ++b) {
        const ElasticBody& body = elastic(b);
        if (body.is_rigid() || is_held(at(b))) continue;
        const Nodes w = body_part(b, to), x = at(b).start.x + dt * body_part(b, from);
        const Momentum way = momentum_of(body, {.x = x, .v = w - body_part(b, from)});
        const Eigen::Vector3d turn =
            dt * rigid_inertia(body, x).bottomRightCorner<3, 3>().ldlt().solve(way.angular);
        const double strain = turn.squaredNorm() / 2, young = at(b).contact_young,
                     volume = body.mass() / body.material().density;
        if (const double kinetic = kinetic_energy(body, w); kinetic > 0)
            largest = std::max(largest, young * volume * strain * strain / 2 / kinetic);
    }
    return largest;
}

/// A part with contacts linearised at its start. Where they lead nowhere near an intersection and press at
/// the end as was solved for, it is done. If not, it goes as far as nothing collides, and is
/// linearised there. v: out, the velocities at the end of the part.
World::Rejection World::solve(const StepPart& part, Eigen::VectorXd& v, WorldReport& report) {
    const double dt = part.dt;
    std::vector<const ContactShape*> shapes;
    std::vector<PrescribedNodes> given;
    for (const Body& body : bodies_) {
        shapes.push_back(body.shape.get());
        given.push_back(prescribed(body, dt));
    }
    // One linearisation stretches a body that turns, which friction on an obstacle that turns it holds back.
    // Then a balance is sought, too, but less and less of one.
    const bool is_asked = config_.step.newton_iterations > 1,
               is_newton = is_asked || turns(obstacles_, time_, time_ + dt);
    const int most = is_asked ? config_.step.newton_iterations : max_linearisations;
    report.solver_converged = true;
    turns_abruptly_ = false;
    barrier().begin_step(time_, dt);
    Eigen::VectorXd to = stacked(&World::likely_velocities, given);
    v = -leads(dt);
    GivenWays given_ways(barrier().obstacles_move() || held_nodes_move(dt, given));
    constexpr const char* too_large = "the velocities of the step are too large, or not finite";
    if (!leads_somewhere(dt, to)) return {.reason = too_large, .fatal = true};
    look(dt, v, to, given_ways.obstacles, report);
    double share = 0, moved = 0;
    std::string left_open;
    double allowed_strain = rigid_strain, allowed_turns = turns_share, allowed_of_gases = least_gas_error,
           allowed_of_winds = least_drag_error;
    double allowed = is_newton ? config_.step.newton_tolerance : contact_share;
    for (int k = 0;; ++k) {
        stop_if_asked();
        timed(report.detect_us, [&] { contacts_ = contacts_at(dt, v, share, given_ways.obstacles, shapes); });
        find_bonds(dt, v);
        timed(report.solve_us, [&] {
            if (k > 0)
                solver_.set_contacts(contacts_, bonds_, v);
            else
                solver_.begin(contacts_, bonds_, shapes, first_unknown_, config_.contact.tolerance, step_,
                              stacked(&World::first_iterate, given), is_newton);
        });
        if (is_newton && k > 0 && given_ways.are_gone()) {
            const double error = residual(v);
            if (error <= allowed) return {};
            left_open = out_of_balance(error, allowed);
            if (!is_asked) allowed *= 2;
        }
        if (k == most || (k > 0 && share < least_progress)) break;
        timed(report.assemble_us, [&] { build_systems(given, k > 0 ? &v : nullptr, config_.step.tangent); });
        const ContactSolveReport solved = timed(report.solve_us, [&] { return solve_systems(to); });
        if (!solved.fallback.empty())
            report.fallback = fmt::format("at {:.6g} s: {}", time_ + dt, solved.fallback);
        report.contacts = solved.active;
        report.solver_converged = report.solver_converged && solved.converged;
        report.contacts_settled = solved.settled;
        ++report.newton_iterations;
        report.solver_iterations += solved.linear_iterations;
        if (!leads_somewhere(dt, to)) return {.reason = too_large, .fatal = true};
        if (k == 0) turns_abruptly_ = !joints_.empty() && strain_of_turns(dt, to) > rigid_strain;
        if (turns_abruptly_ && step_.velocity_factor > 1) return {.reason = "a rigid body turns abruptly"};
        const double trusted = trusted_share(dt, v, to);
        if (trusted < 1) to = v + trusted * (to - v);
        share = propose(dt, v, to, given_ways.obstacles, report);
        if (share == 1 && trusted == 1 && !is_newton) {
            const double error = timed(report.detect_us, [&] { return contact_error(dt, to, shapes); });
            left_open.clear();
            if (error > allowed)
                left_open = out_of_balance(error, allowed);
            else if (!solved.settled)
                left_open = "contacts that press and let go in turn";
            else if (strain_of_turns(dt, to) > allowed_strain)
                left_open = "a rigid body that turns too far";
            else if (share_of_turns(dt, v, to) > allowed_turns)
                left_open =
                    "a body that turns too far in a step for how stiff it is; it may as well be rigid";
            else if (gas_error(to) > allowed_of_gases)
                left_open = "gases whose pressures do not fit their volumes";
            else if (drag_error(to) > allowed_of_winds)
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
            allowed_of_gases *= 2;
            allowed_of_winds *= 2;
        }
        if (k > 0 && given_ways.are_gone()) share = search_line(v, to, share);
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
void World::look(double dt, const Eigen::VectorXd& v, const Eigen::VectorXd& to, double progress,
                 WorldReport& report) {
    const ScopedTimer timer(report.detect_us);
    barrier().look(nodes_after(dt, v), nodes_after(dt, to), progress);
    report.add(barrier().costs());
}

/// The share of the motion from v to `to` that is free of collisions.
double World::propose(double dt, const Eigen::VectorXd& v, const Eigen::VectorXd& to, double progress,
                      WorldReport& report) {
    const ScopedTimer timer(report.detect_us);
    const double share = barrier().move(nodes_after(dt, v), nodes_after(dt, to), progress);
    report.add(barrier().costs());
    return share;
}

/// The largest of share, share / 2, share / 4 ... at which the potential of the step is no higher than at v,
/// as far as rounding lets one tell. The way to `to` leads downwards: it lowers the quadratic model of the
/// linearisation, whose matrix is positive definite.
double World::search_line(const Eigen::VectorXd& v, const Eigen::VectorXd& to, double share) {
    const auto potentials = [&](double s) {  // of the barrier, friction and each body
        const Eigen::VectorXd at_s = v + s * (to - v);
        // Of statics for the normal forces at v, as their solves have them.
        std::vector<double> terms{barrier().energy(s),
                                  solver_.friction_potential(at_s, config_.statics ? v : to),
                                  solver_.bond_potential(at_s)};
        for (int b = 0; b < body_count() && std::isfinite(terms.front()); ++b) {
            const Loads outer = outer_end_loads(at(b));
            const Nodes w = body_part(b, v), w_at_s = body_part(b, at_s);
            terms.push_back(StepPotential(*at(b).elastic, at(b).start, step_, outer, systems_[b].elements())
                                .value(w_at_s));
            terms.push_back(excess_work(at(b), w, w_at_s));
            if (!at(b).gases.empty()) terms.push_back(gas_energy(at(b), at(b).start.x + step_.dt * w_at_s));
            if (!at(b).winds.empty()) terms.push_back(drag_energy(at(b), w_at_s));
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
std::string World::end_fault(double dt, const Eigen::VectorXd& v, WorldReport& report) {
    const ScopedTimer timer(report.detect_us);
    report.least_distance = barrier().least_distance();  // the contacts at v were found last
    const std::vector<Intersection> found = barrier().intersections(nodes_after(dt, v));
    if (!found.empty()) return intersection_text(found, barrier().surfaces());
    return barrier().missed_too_near() ? "surfaces are too near for the next one" : "";
}

}  // namespace nbd
