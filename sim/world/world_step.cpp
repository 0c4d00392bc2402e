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
#include "sim/world/approach.hpp"
#include "sim/world/time_rule.hpp"
#include "sim/world/world.hpp"

namespace nbd {
namespace {

/// Smaller parts tell the motion of a body that turns more. turns: [bodies], radians.
Rejection turned_too_far(const WorldState& world, std::span<const double> turns, double most_rigid) {
    for (int b = 0; b < world.body_count(); ++b) {
        const double most = world.at(b).elastic->is_rigid() ? most_rigid : most_deformable_turn;
        if (turns[b] > most)
            return {.reason = fmt::format("{} turns by {:.2g} rad in a step, more than {}", world.at(b).name,
                                          turns[b], most),
                    .trouble = StepTrouble::newton};
    }
    return {};
}

}  // namespace

WorldReport World::step(double dt) {
    if (!(dt > 0) || !std::isfinite(dt))
        throw std::invalid_argument(fmt::format("world: dt is {}, but must be > 0", dt));
    constexpr double rounding = 1e-9;
    if (state_.config.statics && state_.time + dt > 1 + rounding)
        throw std::invalid_argument(
            fmt::format("world: the increment would end at {:.6g} of the load, but 1 is the whole of it",
                        state_.time + dt));
    WorldReport report;
    timed(report.rest_us, "rest", [&] { take_step(dt, report); });
    return report;
}

/// Fixes from where and until when things move that were given targets since the last step.
void World::start_driving(double dt) {
    targets_.go(state_, barrier(), dt);
    for (SteppedBody& body : state_.bodies) {
        DrivenNodes& driven = body.driven;
        if (driven.end > driven.start) continue;
        driven.from = body.state.x(driven.nodes, Eigen::all);
        driven.start = state_.time;
        driven.end = state_.time + dt;
    }
}

/// At the begin of a part: grips whose time has come take their nodes where these are.
void World::take_nodes() {
    for (SteppedBody& body : state_.bodies)
        for (std::size_t g = 0; g < body.grips.size(); ++g)
            if (body.grip_start[g].rows() == 0 && body.grips[g].holds(state_.time))
                body.grip_start[g] = body.state.x(body.grips[g].nodes, Eigen::all);
}

/// Takes a step, or nothing of it where something is thrown.
void World::take_step(double dt, WorldReport& report) {
    check_start();
    start_driving(dt);
    for (SteppedBody& body : state_.bodies) body.contact_forces.setZero();
    reactions_.clear();
    const PartStart start = part_start();
    try {
        take_parts(dt, start, report);
        measure(report);
        for (int b = 0; b < state_.body_count(); ++b)
            for (int k = 0; k < std::ssize(state_.at(b).cavities); ++k)
                reactions_.add(b, ReactionBy::cavity, k, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(),
                               {});
        tell_trouble(report);
        targets_.clear();
    } catch (...) {
        take_back(start);
        for (SteppedBody& body : state_.bodies)  // nodes driven in this step move in the next one
            if (body.driven.start == state_.time) body.driven.end = state_.time;
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
                            .finest = report.substeps >= state_.config.step.max_substeps};
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
            if (state_.config.statics && !rejection.is_final && report.substeps > 1)
                report.failure += fmt::format("; the increment was cut into {} parts", report.substeps);
            break;
        }
        report.substeps *= 2;
        done *= 2;
    }
    report.time = state_.time;
}

std::string World::when(double time) const {
    return state_.config.statics ? fmt::format("at {:.6g} of the load", time)
                                 : fmt::format("at {:.6g} s", time);
}

/// What went wrong shows only at the end of the step where no part of it was rejected.
void World::tell_trouble(WorldReport& report) const {
    if (report.failure.empty() && report.trouble == StepTrouble::none && report.inverted_elements > 0) {
        report.trouble = StepTrouble::inverted;
        report.trouble_reason =
            fmt::format("at {:.6g} s: {} tetrahedra are inside out", state_.time, report.inverted_elements);
    }
    if (report.trouble == StepTrouble::none && !report.contacts_settled) {
        report.trouble = StepTrouble::contact_passes;
        report.trouble_reason =
            fmt::format("at {:.6g} s: {} passes did not settle which contacts press and slip", state_.time,
                        ContactSolver::most_passes);
    }
}

World::PartStart World::part_start() const {
    PartStart start{.snapshot = snapshot(), .contact_forces = {}, .energies = {}, .reactions = reactions_};
    for (const SteppedBody& body : state_.bodies) {
        start.contact_forces.push_back(body.contact_forces);
        start.energies.push_back(body.energy);
    }
    return start;
}

void World::take_back(const PartStart& start) {
    reset(start.snapshot);
    reactions_ = start.reactions;
    for (int b = 0; b < state_.body_count(); ++b) {
        state_.at(b).contact_forces = start.contact_forces[b];
        state_.at(b).energy = start.energies[b];
    }
}

/// Advances by one part.
Rejection World::try_part(const StepPart& part, WorldReport& report) {
    take_nodes();
    const std::vector<double> turns = turns_in(state_, part.dt);
    Rejection rejection = turned_too_far(state_, turns, most_rigid_turn);
    if (rejection && !part.finest) return rejection;
    choose_steps(state_, joint_forces_, turns, part.dt);
    tendon_solve_.begin(state_.tendons.size());
    if (Rejection passes = pass_of_ball(state_, part.dt)) rejection = std::move(passes);
    if (rejection && !part.finest) return rejection;
    std::vector<char> caught;  // [bodies]
    try {
        Eigen::VectorXd v;
        barrier().be_exact(false);
        PartSolve solve(part, state_, equations_, barrier(), tendon_solve_, friction_memory_);
        const Rejection unsolved = solve.run(v, report);
        if (unsolved) rejection = unsolved;
        if (!rejection && !state_.config.statics)
            rejection = turned_too_far(state_, rigid_turns(state_, v), 2 * most_rigid_turn);
        if (rejection && (!part.finest || rejection.fatal)) return rejection;
        caught.assign(solve.caught().begin(), solve.caught().end());
        // Impulses that do not balance the motion tell nothing of its momentum.
        const bool is_solved = !unsolved && report.contacts_settled;
        const bool is_short = solve.fell_short_of().size() > 0;
        const std::vector<Nodes> before = is_short ? state_.nodes_now() : std::vector<Nodes>{};
        if (std::string failure = move(part, v, is_solved, report); !failure.empty())
            return {.reason = failure, .fatal = true};
        if (is_short) end_short(solve.fell_short_of(), before);
        friction_memory_.remember(equations_.solver.rubbed(v));
        if (is_solved) joint_forces_.break_joints(state_, equations_, v);  // else impulses are noise
        if (const std::string fault = joint_fault(state_, equations_.bonds, v);
            !fault.empty() && report.trouble == StepTrouble::none) {
            report.trouble = StepTrouble::joint;
            report.trouble_reason = fmt::format("{}: {}", when(part.end), fault);
        }
    } catch (const std::runtime_error& error) {
        return {.reason = error.what(), .fatal = true};
    }
    state_.time = part.end;
    state_.dt_before = part.dt;
    if (std::ranges::find(caught, 1) != caught.end()) {
        for (std::size_t b = 0; b < caught.size(); ++b)
            if (caught[b]) forget_rates(state_.bodies[b]);
        joint_forces_.forget(state_, caught);
    }
    return rejection;
}

void World::measure(WorldReport& report) const {
    for (const SteppedBody& body : state_.bodies) {
        report.kinetic_energy += kinetic_energy(*body.elastic, body.state.v);
        if (!body.elastic->is_rigid()) report.elastic_energy += body.energy;  // else of the solver alone
        const Eigen::Vector3d moment = body.state.x.transpose() * body.elastic->node_masses();
        report.gravity_energy -= state_.gravity_at(state_.time).dot(moment);
    }
}

}  // namespace nbd
