// How a world takes a step.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "collision/base/stopwatch.hpp"
#include "sim/fem/kinetic_energy.hpp"
#include "sim/fem/step_potential.hpp"
#include "sim/world/world.hpp"

namespace nbd {
namespace {

/// Why a pose is unusable; empty where it is not.
std::string pose_failure(int body, const ElementReport& elements, const ElementPose& pose,
                         const FailureLimits& limits) {
    if (elements.non_finite > 0)
        return fmt::format("body {}: {} tetrahedra are not finite, the first is {}", body,
                           elements.non_finite, elements.first_non_finite);
    const auto count = static_cast<double>(pose.F.size());
    if (elements.inverted > limits.inverted_share * count)
        return fmt::format("body {}: {} of {} tetrahedra are inverted, the first is {}", body,
                           elements.inverted, pose.F.size(), elements.first_inverted);
    for (std::size_t t = 0; t < pose.F.size(); ++t)
        if (pose.F[t].norm() > limits.stretch)
            return fmt::format("body {}: tetrahedron {} is stretched {:.1f} times, more than {}", body, t,
                               pose.F[t].norm(), limits.stretch);
    return {};
}

}  // namespace

/// Makes contacts those of a step of dt from the present state.
void World::detect(double dt) {
    if (detected_dt_ == dt) return;
    forget_contacts();
    sides_before_ = detection_.sides();
    detected_ = {};
    std::vector<ContactParty> parties;
    for (Body& body : bodies_) {
        body.surface.update(body.state.x);
        const Stopwatch watch;
        if (body.tree) body.tree->begin_pose(body.surface.x_float(), motion(body));
        detected_.update_us += watch.microseconds();
        parties.push_back({*body.elastic, body.state, body.surface, body.tree.get()});
    }
    detection_.find(parties, obstacles_, config_.contact, thickness(), time_, dt_before_, dt, detected_);
    detected_dt_ = dt;
}

PrescribedNodes World::prescribed(const Body& body, double dt) const {
    PrescribedNodes result;
    std::vector<Eigen::Vector3d> v;
    for (std::size_t g = 0; g < body.grips.size(); ++g) {
        const Grip& grip = body.grips[g];
        if (time_ >= grip.release) continue;
        for (std::size_t k = 0; k < grip.nodes.size(); ++k) {
            const Eigen::Vector3d x0 = body.grip_start[g].row(static_cast<Eigen::Index>(k));
            const Eigen::Vector3d x = body.state.x.row(grip.nodes[k]);
            result.nodes.push_back(grip.nodes[k]);
            v.push_back((grip_target(grip, x0, time_ + dt) - x) / dt);
        }
    }
    result.v.resize(static_cast<Eigen::Index>(v.size()), 3);
    for (std::size_t i = 0; i < v.size(); ++i) result.v.row(static_cast<Eigen::Index>(i)) = v[i];
    return result;
}

/// Those before the step, but for nodes whose velocity over the step is given.
Eigen::VectorXd World::start_velocities(const std::vector<PrescribedNodes>& given) const {
    Eigen::VectorXd v(first_unknown_.back());
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
        Eigen::Map<Nodes> part(v.data() + first_unknown_[b], bodies_[b].state.v.rows(), 3);
        part = bodies_[b].state.v;
        part(given[b].nodes, Eigen::all) = given[b].v;
    }
    return v;
}

Nodes World::body_part(int body, const Eigen::VectorXd& stacked) const {
    return Eigen::Map<const Nodes>(stacked.data() + first_unknown_[static_cast<std::size_t>(body)],
                                   at(body).state.v.rows(), 3);
}

/// iterate: velocities to linearise at; null: those before the step.
void World::build_systems(double dt, const std::vector<PrescribedNodes>& given,
                          const Eigen::VectorXd* iterate) {
    for (int b = 0; b < body_count(); ++b)
        systems_[static_cast<std::size_t>(b)].assemble(at(b).state, dt, loads(at(b)),
                                                       iterate ? body_part(b, *iterate) : Nodes());
    for (std::size_t b = 0; b < bodies_.size(); ++b) systems_[b].prescribe(given[b]);
}

/// v: out, the velocities at the end of the step.
World::Rejection World::solve(double dt, Eigen::VectorXd& v, WorldReport& report) {
    std::vector<const ContactSurface*> surfaces;
    std::vector<PrescribedNodes> given;
    for (const Body& body : bodies_) {
        surfaces.push_back(&body.surface);
        given.push_back(prescribed(body, dt));
    }
    v = start_velocities(given);
    solver_.begin(detection_.contacts(), surfaces, first_unknown_, config_.contact, thickness(), dt, v);
    const int most = config_.step.newton_iterations;
    double left = 0;
    for (int k = 0; k < most; ++k) {
        const Eigen::VectorXd from = v;
        const Stopwatch assembly;
        build_systems(dt, given, most > 1 ? &from : nullptr);
        report.assemble_us += assembly.microseconds();
        const Stopwatch solution;
        const ContactSolveReport solved = solver_.solve(systems_, v);
        report.solve_us += solution.microseconds();
        report.patch_nodes = std::max(report.patch_nodes, solved.patch_nodes);
        if (!solved.fallback.empty())
            report.fallback = fmt::format("at {:.6g} s: {}", time_ + dt, solved.fallback);
        ++report.newton_iterations;
        report.contacts = solved.active;
        report.solver_iterations += solved.linear_iterations;
        report.solver_converged = report.solver_converged && solved.converged;
        if (!solved.converged) return {.reason = "the linear system was not solved to its tolerance"};
        if (most == 1) return {};
        search_line(dt, from, v);
        left = residual(dt, v);
        if (left <= config_.step.newton_tolerance) return {};
    }
    return {.reason = fmt::format("Newton's iteration left {:.2g} of the loads unbalanced", left)};
}

/// Moves `to` towards `from`, by halves, until the potential of the step is no higher than there.
void World::search_line(double dt, const Eigen::VectorXd& from, Eigen::VectorXd& to) {
    constexpr int max_halvings = 6;
    const Eigen::VectorXd friction_at = to;
    const auto potential = [&](const Eigen::VectorXd& v) {
        double sum = solver_.potential(v, friction_at);
        for (int b = 0; b < body_count(); ++b) {
            const Loads outer = loads(at(b));
            sum += StepPotential(*at(b).elastic, at(b).state, dt, outer,
                                 systems_[static_cast<std::size_t>(b)].elements())
                       .value(body_part(b, v));
        }
        return sum;
    };
    const double before = potential(from);
    for (int k = 0; k < max_halvings && !(potential(to) <= before); ++k) to = (from + to) / 2;
}

/// Impulse by which the free nodes' equations are off at v, over that of the right-hand side.
double World::residual(double dt, const Eigen::VectorXd& v) {
    solver_.linearise(v);
    const Eigen::VectorXd contact = solver_.impulses(v);
    double squared = 0, scale = 0;
    for (int b = 0; b < body_count(); ++b) {
        const StepSystem& system = systems_[static_cast<std::size_t>(b)];
        const Loads outer = loads(at(b));
        Nodes off = StepPotential(*at(b).elastic, at(b).state, dt, outer, system.elements())
                        .gradient(body_part(b, v)) -
                    body_part(b, contact);
        for (int i = 0; i < off.rows(); ++i) {
            if (system.is_prescribed(i)) continue;
            squared += off.row(i).squaredNorm();
            scale += system.rhs().segment<3>(3 * i).squaredNorm();
        }
    }
    return scale > 0 ? std::sqrt(squared / scale) : std::sqrt(squared);
}

/// Moves the bodies over the step. share: of the whole step whose mean contact forces are kept. Returns why
/// that cannot be, and does nothing then; else an empty text.
std::string World::move(double dt, const Eigen::VectorXd& v, double share, WorldReport& report) {
    int inverted = 0;
    for (int b = 0; b < body_count(); ++b) {
        Body& body = at(b);
        body.elastic->pose(body.state.x + dt * body_part(b, v), body.pose, body.meter.get());
        const ElementReport elements = body.elastic->check(body.pose);
        inverted += elements.inverted;
        std::string failure = pose_failure(b, elements, body.pose, config_.limits);
        if (!failure.empty()) return failure;
    }
    const Eigen::VectorXd impulses = solver_.impulses(v);
    for (int b = 0; b < body_count(); ++b) {
        Body& body = at(b);
        body.state.v = body_part(b, v);
        body.state.x += dt * body.state.v;
        body.measured = true;
        body.contact_forces += share / dt * body_part(b, impulses);
    }
    report.inverted_elements = inverted;
    return {};
}

/// Goes from the present state to that at time `end`, dt later. last: goes there in spite of trouble that is
/// no failure.
World::Rejection World::try_part(double dt, double end, double share, bool last, WorldReport& report) {
    detect(dt);
    report.face_pairs += detected_.face_pairs;
    report.nodes_bounded += detected_.nodes_bounded;
    report.nodes_out_of_range += detected_.nodes_out_of_range;
    report.update_us += detected_.update_us;
    report.collision_us += detected_.collision_us;
    const double depth = detection_.deepest(), max_approach = 4 * thickness();
    Rejection rejection;
    if (detected_.approach > max_approach)
        rejection.reason = fmt::format("bodies close in by {:.2g} m in a step, more than {:.2g}",
                                       detected_.approach, max_approach);
    if (!rejection.reason.empty() && !last) return rejection;
    try {
        Eigen::VectorXd v;
        if (Rejection solving = solve(dt, v, report); !solving.reason.empty()) rejection = solving;
        if (!rejection.reason.empty() && !last) return rejection;
        if (std::string failure = move(dt, v, share, report); !failure.empty())
            return {.reason = failure, .failure = true};
    } catch (const std::runtime_error& error) {
        return {.reason = error.what(), .failure = true};
    }
    time_ = end;
    dt_before_ = dt;
    detected_dt_ = 0;
    detect(dt);
    if (detection_.deepest() > depth + thickness() / 2)
        rejection.reason =
            fmt::format("contacts came to overlap by {:.2g} m in a step", detection_.deepest());
    return rejection;
}

// Contacts at the end of a part tell whether it went well, and are those that the next part begins with; what
// they cost is reported where they are used, so that a run that continues from a snapshot reports the same.
WorldReport World::step(double dt) {
    if (!(dt > 0) || !std::isfinite(dt))
        throw std::invalid_argument(fmt::format("world: dt is {}, but must be > 0", dt));
    WorldReport report;
    const double start = time_;
    for (Body& body : bodies_) body.contact_forces.setZero();
    report.substeps = 1;
    for (int done = 0; done < report.substeps;) {
        const bool last = report.substeps >= config_.step.max_substeps;
        const double share = 1.0 / report.substeps, end = start + dt * ((done + 1) * share);
        const WorldSnapshot before = snapshot();
        std::vector<Nodes> forces;
        for (const Body& body : bodies_) forces.push_back(body.contact_forces);
        const Rejection rejection = try_part(dt * share, end, share, last, report);
        if (!rejection.reason.empty())
            report.rejection = fmt::format("at {:.6g} s: {}", end, rejection.reason);
        if (rejection.reason.empty() || (last && !rejection.failure)) {
            ++done;
            continue;
        }
        reset(before);
        for (int b = 0; b < body_count(); ++b) at(b).contact_forces = forces[static_cast<std::size_t>(b)];
        if (last) {
            report.failure = report.rejection;
            break;
        }
        report.substeps *= 2;
        done *= 2;
    }
    report.time = time_;
    report.deepest_penetration = detection_.deepest();
    measure(report);
    return report;
}

void World::measure(WorldReport& report) const {
    for (const Body& body : bodies_) {
        report.kinetic_energy += kinetic_energy(*body.elastic, body.state.v);
        if (!body.pose.F.empty()) report.elastic_energy += body.elastic->energy(body.pose);
        const Eigen::Vector3d moment = body.state.x.transpose() * body.elastic->node_masses();
        report.gravity_energy -= config_.gravity.dot(moment);
    }
}

}  // namespace nbd
