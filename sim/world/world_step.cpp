// A step, and its parts: solution, motion, and whether the result is rejected.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <utility>

#include "collision/base/stop.hpp"
#include "collision/base/stopwatch.hpp"
#include "sim/fem/momentum.hpp"
#include "sim/world/world.hpp"

namespace nbd {
namespace {

constexpr double most_turn = 0.6;  // radians, of a rigid body in a step

/// Why the simulation has failed in this pose; empty: it has not.
std::string pose_failure(int body, const ElementReport& elements, int count, const FailureLimits& limits) {
    if (elements.non_finite > 0)
        return fmt::format("body {}: {} tetrahedra are not finite, the first is {}", body,
                           elements.non_finite, elements.first_non_finite);
    if (elements.inverted > limits.inverted_share * count)
        return fmt::format("body {}: {} of {} tetrahedra are inverted, the first is {}", body,
                           elements.inverted, count, elements.first_inverted);
    if (elements.stretch > limits.stretch)
        return fmt::format("body {}: tetrahedron {} is stretched {:.1f} times, more than {}", body,
                           elements.most_stretched, elements.stretch, limits.stretch);
    return {};
}

}  // namespace

WorldReport World::step(double dt) {
    if (!(dt > 0) || !std::isfinite(dt))
        throw std::invalid_argument(fmt::format("world: dt is {}, but must be > 0", dt));
    constexpr double rounding = 1e-9;
    if (config_.statics && time_ + dt > 1 + rounding)
        throw std::invalid_argument(fmt::format(
            "world: the increment would end at {:.6g} of the load, but 1 is the whole of it", time_ + dt));
    WorldReport report;
    timed(report.rest_us, [&] { take_step(dt, report); });
    return report;
}

/// Takes a step, or nothing of it where something is thrown.
void World::take_step(double dt, WorldReport& report) {
    check_start();
    start_driving(dt);
    for (Body& body : bodies_) body.contact_forces.setZero();
    reactions_.clear();
    const PartStart start = part_start();
    try {
        take_parts(dt, start, report);
        measure(report);
        for (int b = 0; b < body_count(); ++b)
            for (int k = 0; k < std::ssize(at(b).cavities); ++k)
                reactions_.add(b, ReactionBy::cavity, k, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(),
                               {});
        tell_trouble(report);
        next_ = {};
    } catch (...) {
        take_back(start);
        for (Body& body : bodies_)  // nodes driven in this step move in the next one
            if (body.driven.start == time_) body.driven.end = time_;
        throw;
    }
}

/// Takes a step in equal parts, at first in one. A rejected part is taken back and halved, with all that are
/// left.
void World::take_parts(double dt, const PartStart& begin, WorldReport& report) {
    report.substeps = 1;
    std::optional<PartStart> later;  // what a part began from that is not the first
    for (int done = 0; done < report.substeps;) {
        const double share = 1.0 / report.substeps;
        const StepPart part{.dt = dt * share,
                            .end = begin.snapshot.time + dt * ((done + 1) * share),
                            .share = share,
                            .finest = report.substeps >= config_.step.max_substeps};
        const PartStart& start = done == 0 ? begin : later.emplace(part_start());
        // Of the parts that are kept.
        const bool settled = std::exchange(report.contacts_settled, true);
        const bool converged = std::exchange(report.solver_converged, true);
        stop_if_asked();
        const Rejection rejection = try_part(part, report);
        if (rejection) report.rejection = fmt::format("{}: {}", when(part.end), rejection.reason);
        const bool is_kept = !rejection || (part.finest && !rejection.fatal);
        report.contacts_settled = settled && (report.contacts_settled || !is_kept);
        report.solver_converged = converged && (report.solver_converged || !is_kept);
        if (is_kept) {
            if (rejection && report.trouble == StepTrouble::none) {
                report.trouble = rejection.trouble;
                report.trouble_reason = report.rejection;
            }
            ++done;
            continue;
        }
        take_back(start);
        if (part.finest || rejection.is_final) {
            report.failure = report.rejection;
            if (config_.statics && !rejection.is_final && report.substeps > 1)
                report.failure += fmt::format("; the increment was cut into {} parts", report.substeps);
            break;
        }
        report.substeps *= 2;
        done *= 2;
    }
    report.time = time_;
}

std::string World::when(double time) const {
    return config_.statics ? fmt::format("at {:.6g} of the load", time) : fmt::format("at {:.6g} s", time);
}

/// What went wrong shows only at the end of the step where no part of it was rejected.
void World::tell_trouble(WorldReport& report) const {
    if (report.failure.empty() && report.trouble == StepTrouble::none && report.inverted_elements > 0) {
        report.trouble = StepTrouble::inverted;
        report.trouble_reason =
            fmt::format("at {:.6g} s: {} tetrahedra are inside out", time_, report.inverted_elements);
    }
    if (report.trouble == StepTrouble::none && !report.contacts_settled) {
        report.trouble = StepTrouble::contact_passes;
        report.trouble_reason =
            fmt::format("at {:.6g} s: {} passes did not settle which contacts press and slip", time_,
                        ContactSolver::most_passes);
    }
}

World::PartStart World::part_start() const {
    PartStart start{.snapshot = snapshot(), .contact_forces = {}, .energies = {}, .reactions = reactions_};
    for (const Body& body : bodies_) {
        start.contact_forces.push_back(body.contact_forces);
        start.energies.push_back(body.energy);
    }
    return start;
}

void World::take_back(const PartStart& start) {
    reset(start.snapshot);
    reactions_ = start.reactions;
    for (int b = 0; b < body_count(); ++b) {
        at(b).contact_forces = start.contact_forces[b];
        at(b).energy = start.energies[b];
    }
}

/// A hundred-thousandth of the smallest body: nobody sees that friction gives by as much before it slides. Or
/// a thousandth of a fall from rest, where steps are long: a stiffer spring would be settled by no iteration.
double World::slip_length(double dt) const noexcept {
    if (config_.statics) return 1e-5 * smallest_diagonal();
    double gravity = config_.gravity.norm();
    for (const Eigen::Vector3d& value : config_.gravity_keys.values)
        gravity = std::max(gravity, value.norm());
    return std::max(1e-5 * smallest_diagonal(), 1e-3 * gravity * dt * dt);
}

/// Moves the bodies by the solution v of the step and, if the step was solved to its tolerance, gives those
/// that nothing holds the momentum that loads and contacts leave them and the solve has lost, as far as
/// contacts let them have it. Impulses of the solver are `factor` times those that act, see StepSystem.
/// Returns an empty text, or why the simulation has failed; the bodies then stay where they are.
std::string World::move(const StepPart& part, const Eigen::VectorXd& v, bool is_solved, WorldReport& report) {
    int inverted = 0;
    std::vector<double> energies;
    BodyPositions last{.x = nodes_after(part.dt, v), .centres = {}};
    const std::vector<Nodes>& ends = last.x;
    last.centres = centres_of(ends);
    const auto [dt, factor] = step_;
    BodyPositions middles;
    for (int b = 0; b < body_count(); ++b) {
        const Body& body = at(b);
        middles.x.push_back(middle(body));
        middles.centres.push_back(centre_of_mass(*body.elastic, middles.x.back()));
        const ElementReport elements = body.elastic->measure(ends[b]);
        inverted += elements.inverted;
        std::string failure = pose_failure(b, elements, body.elastic->element_count(), config_.limits);
        if (!failure.empty()) return failure;
        energies.push_back(elements.energy);
    }
    for (int b = 0; b < body_count(); ++b) at(b).energy = energies[b];
    report.inverted_elements = inverted;
    if (config_.statics) {
        come_to_rest(part, v, last);
        return {};
    }
    const Eigen::VectorXd impulses = solver_.step_impulses(v);
    const Eigen::VectorXd all = bonds_.empty() ? impulses : solver_.impulses(v);
    const std::vector<Momentum> of_contacts = solver_.momenta(v, middles, last);
    std::vector<RigidVector> missing;  // impulses
    std::vector<std::optional<RigidMatrix>> inertia;
    for (int b = 0; b < body_count(); ++b) {
        Body& body = at(b);
        const std::size_t index = b;
        Momentum momentum = end_momentum(b, ends[index], of_contacts[index]);
        advance(b, body_part(b, v), impulses, all);
        const Momentum solved = momentum_of(*body.elastic, body.state);
        // Damping by mass takes its share of an impulse, too.
        const double lasting = factor * (1 + dt * body.elastic->material().rayleigh_mass);
        missing.emplace_back() << momentum.linear - solved.linear, momentum.angular - solved.angular;
        missing.back() *= lasting;
        inertia.emplace_back();
        if (!is_held(body)) inertia.back() = factor * lasting * rigid_inertia(*body.elastic, body.state.x);
    }
    std::vector<Eigen::Vector3d> more;  // impulses of the response
    if (is_solved) {
        // Where a step is long for contacts, momentum that is given without them would grow from step to
        // step.
        BodyPositions now{.x = nodes_now(), .centres = {}};
        now.centres = centres_of(now.x);
        ContactSolver::RigidResponse response = solver_.response(v, missing, inertia, now);
        more = std::move(response.of_each);
        for (int b = 0; b < body_count(); ++b)  // what holds a body lets it get no momentum of these
            if (const Eigen::Index held = at(b).holding.rows(); held > 0)
                at(b).holding.rowwise() -=
                    body_part(b, response.impulses).colwise().sum() / (factor * static_cast<double>(held));
        std::vector<char> fits(bodies_.size(), 1);
        for (int b = 0; b < body_count(); ++b)
            fits[b] = !is_joined(b) || is_fit(factor * response.motions[b], b);
        const bool may_refuse = std::ranges::find(fits, 0) != fits.end();
        std::vector<PairImpulse> touching;
        if (may_refuse) touching = solver_.pair_impulses(v, more, middles);
        for (bool goes_on = may_refuse; goes_on;) {  // what bodies give to one another they all get, or none
            goes_on = false;
            const auto agree = [&](int a, int b) {
                if (a < 0 || b < 0 || fits[a] == fits[b]) return;
                fits[a] = fits[b] = 0;
                goes_on = true;
            };
            for (const JointBonds& joint : joints_) agree(joint.joint().a, joint.joint().b);
            for (const PairImpulse& pair : touching) agree(pair.body, pair.other);
        }
        for (int b = 0; b < body_count(); ++b)
            if (fits[b]) add_motion(*at(b).elastic, factor * response.motions[b], at(b).state);
    } else {
        // What did not balance the motion is no force of the body.
        for (Body& body : bodies_) body.inner_forces.resize(0, 3);
    }
    for (int b = 0; b < body_count(); ++b) {
        add_holding_reactions(part, b, middles.x[b]);
        add_wind_reactions(part, b, body_part(b, v), middles.x[b]);
    }
    add_contact_reactions(part, solver_.pair_impulses(v, more, middles));
    add_joint_reactions(part, v, more, middles, last);
    springs_before_ = springs_;
    const Eigen::VectorXd of_contact = solver_.contact_impulses(v, more);
    for (int b = 0; b < body_count(); ++b)
        at(b).contact_forces += part.share / (factor * dt) * body_part(b, of_contact);
    return {};
}

/// Whether a motion that a jointed body is to get has no more energy than it and a fall in the step explain:
/// where a motor or light links hold it, the impulses of joints are large, and what they leave is noise.
bool World::is_fit(const RigidVector& motion, int index) const {
    constexpr double share = 2;
    const Body& body = at(index);
    const double energy = motion.dot(rigid_inertia(*body.elastic, body.state.x) * motion) / 2,
                 fall = body.elastic->mass() * (gravity_before_ * step_.dt).squaredNorm();
    return energy <= share * (kinetic_energy(*body.elastic, body.state.v) +
                              kinetic_energy(*body.elastic, body.before->v) + fall);
}

/// Solves a part so that it ends where the next can begin, anew with exact bounds where others fail. v: out,
/// see solve().
World::Rejection World::solve_safely(const StepPart& part, Eigen::VectorXd& v, WorldReport& report) {
    for (;;) {
        Rejection rejection = config_.statics ? balance(part, v, report) : solve(part, v, report);
        if (turns_abruptly_ && step_.velocity_factor > 1) {
            begin_backward_euler(part.dt);
            continue;
        }
        if (rejection && (!part.finest || rejection.is_final)) return rejection;
        if (!rejection.fatal) {
            const std::string fault = end_fault(part.dt, v, report);
            if (fault.empty()) return rejection;
            rejection = {.reason = "the step would end where " + fault, .fatal = true};
        }
        if (!barrier().can_miss()) return rejection;
        ++report.exact_parts;
        barrier().be_exact(true);
    }
}

/// Advances by one part.
World::Rejection World::try_part(const StepPart& part, WorldReport& report) {
    take_nodes();
    if (const double turn = largest_turn(part.dt); turn > most_turn && !part.finest)
        return {.reason = fmt::format("a rigid body would turn by {:.2g} rad in a step, more than {}", turn,
                                      most_turn)};
    choose_steps(part.dt);
    Rejection rejection = pass_of_ball(part.dt);
    if (rejection && !part.finest) return rejection;
    try {
        Eigen::VectorXd v;
        barrier().be_exact(false);
        const Rejection unsolved = solve_safely(part, v, report);
        if (unsolved) rejection = unsolved;
        if (rejection && (!part.finest || rejection.fatal)) return rejection;
        // Impulses that do not balance the motion tell nothing of its momentum.
        const bool is_solved = !unsolved && report.contacts_settled;
        if (std::string failure = move(part, v, is_solved, report); !failure.empty())
            return {.reason = failure, .fatal = true};
        friction_memory_.remember(solver_.rubbed(v));
        if (is_solved) break_joints(part.dt, v);  // else impulses are noise
        if (const std::string fault = joint_fault(part.dt, v);
            !fault.empty() && report.trouble == StepTrouble::none) {
            report.trouble = StepTrouble::joint;
            report.trouble_reason = fmt::format("{}: {}", when(part.end), fault);
        }
    } catch (const std::runtime_error& error) {
        return {.reason = error.what(), .fatal = true};
    }
    time_ = part.end;
    dt_before_ = part.dt;
    return rejection;
}

void World::measure(WorldReport& report) const {
    for (const Body& body : bodies_) {
        report.kinetic_energy += kinetic_energy(*body.elastic, body.state.v);
        report.elastic_energy += body.energy;
        const Eigen::Vector3d moment = body.state.x.transpose() * body.elastic->node_masses();
        report.gravity_energy -= gravity_at(time_).dot(moment);
    }
}

}  // namespace nbd
