// One part of a step without intersections: Newton's iteration over bodies that a barrier keeps apart.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "collision/base/stop.hpp"
#include "collision/base/stopwatch.hpp"
#include "sim/fem/step_potential.hpp"
#include "sim/world/world.hpp"

namespace nbd {
namespace {

constexpr int max_linearisations = 100;  // unless the step's config allows several itself
constexpr int max_halvings = 40;         // of a Newton step, until the potential falls
constexpr double rounding = 1e-12;       // relative, of a potential
constexpr double least_progress = 1e-9;  // share of a Newton step that counts as motion

bool moves(const PrescribedNodes& given) { return !given.v.isZero(0); }

}  // namespace

/// Made where it is first asked for.
Barrier& World::barrier() {
    if (barrier_) return *barrier_;
    auto made = std::make_unique<Barrier>(config_.contact, thickness());
    for (const Body& body : bodies_)
        made->add_body(body.surface.shape(), body.elastic->rest().X, body.contact_young);
    for (const Obstacle& obstacle : obstacles_) made->add_obstacle(obstacle);
    made->begin();
    barrier_ = std::move(made);
    return *barrier_;
}

std::vector<Nodes> World::nodes_now() const {
    std::vector<Nodes> nodes;
    for (const Body& body : bodies_) nodes.push_back(body.state.x);
    return nodes;
}

std::vector<Intersection> World::intersecting_faces() {
    barrier().begin_step(time_, 0);
    return barrier().intersections(nodes_now());
}

void World::check_start() {
    if (!config_.contact.intersection_free || start_is_checked_) return;
    barrier().check_rest();
    if (const auto found = intersecting_faces(); !found.empty())
        throw std::invalid_argument(fmt::format("without intersections, the start must have none, but {}",
                                                intersection_text(found, barrier().surfaces())));
    barrier().move(nodes_now(), nodes_now(), 0);
    if (!std::isfinite(barrier().energy(0)))
        throw std::invalid_argument(fmt::format(
            "without intersections, surfaces must start apart, but the nearest are {:.2g} m apart; "
            "allowed: more than {:.2g} m",
            barrier().least_distance(), barrier().floor()));
    start_is_checked_ = true;
}

/// Positions of the nodes of all bodies at dt with the unknown v of the step.
std::vector<Nodes> World::nodes_after(double dt, const Eigen::VectorXd& v) const {
    std::vector<Nodes> nodes;
    for (int b = 0; b < body_count(); ++b) nodes.push_back(start_of(at(b)).x + dt * body_part(b, v));
    return nodes;
}

/// v: out, the velocities at the end of the part. Every iterate is free of intersections.
World::Rejection World::solve_apart(const StepPart& part, Eigen::VectorXd& v, WorldReport& report) {
    const double dt = part.dt;
    std::vector<const ContactSurface*> surfaces;
    std::vector<PrescribedNodes> given;
    for (const Body& body : bodies_) {
        surfaces.push_back(&body.surface);
        given.push_back(prescribed(body, dt));
    }
    barrier().begin_step(time_, dt);
    const Eigen::VectorXd predicted = stacked(&World::first_iterate, given);
    v.setZero(first_unknown_.back());
    // How far grips and obstacles have come.
    double progress = barrier().obstacles_move() || std::ranges::any_of(given, moves) ? 0 : 1;
    double share = propose(dt, v, predicted, progress, report), moved = share;
    progress = std::max(progress, share);
    std::vector<FrictionContact> friction;
    for (const BarrierContact& c : barrier().contacts(0))
        if (c.contact.friction > 0) friction.push_back({c.contact, -dt * c.slope});
    barrier_solver_.begin_step(surfaces, first_unknown_, config_.contact.slip_velocity, dt,
                               std::move(friction));
    v = share * predicted;
    const int most = config_.step.newton_iterations > 1 ? config_.step.newton_iterations : max_linearisations;
    double size = 0, goal = 0;
    bool stuck = false;
    for (int k = 0; k < most && !stuck; ++k) {
        stop_if_asked();
        const Stopwatch assembly;
        build_systems(given, &v);
        report.assemble_us += assembly.microseconds();
        const Stopwatch solution;
        barrier_solver_.set_contacts(barrier().contacts(share));
        Eigen::VectorXd to = v;
        const LinearSolveReport solved = barrier_solver_.solve(systems_, 1 - progress, to);
        report.solve_us += solution.microseconds();
        if (!solved.fallback.empty())
            report.fallback = fmt::format("at {:.6g} s: {}", time_ + dt, solved.fallback);
        report.solver_converged = report.solver_converged && solved.converged;
        ++report.newton_iterations;
        report.solver_iterations += solved.iterations;
        report.contacts = barrier_solver_.contact_count();
        size = dt * (to - v).cwiseAbs().maxCoeff();
        goal = config_.step.newton_tolerance * std::max(thickness(), dt * to.cwiseAbs().maxCoeff());
        if (progress == 1 && size <= goal && solved.converged) return {};
        const double free = propose(dt, v, to, progress, report);
        share = progress < 1 ? free : search_apart(dt, v, to, free);
        v += share * (to - v);
        progress = share == 1 ? 1 : progress + share * (1 - progress);
        moved = std::max(moved, share);
        stuck = share < least_progress;
    }
    barrier_solver_.set_contacts(barrier().contacts(share));
    if (progress < 1)
        return {.reason = fmt::format("grips and obstacles cannot go {:.2g} of their way without an "
                                      "intersection",
                                      1 - progress),
                .fatal = true};
    if (moved < least_progress) return {.reason = "the step finds no progress", .fatal = true};
    return {
        .reason = fmt::format("Newton's iteration ends {:.2g} m from balance, allowed: {:.2g}", size, goal),
        .trouble = StepTrouble::newton};
}

/// The share of the motion from v to `to` that is free of collisions.
double World::propose(double dt, const Eigen::VectorXd& v, const Eigen::VectorXd& to, double progress,
                      WorldReport& report) {
    const Stopwatch watch;
    const double share = barrier().move(nodes_after(dt, v), nodes_after(dt, to), progress);
    report.face_pairs += barrier().face_pairs();
    const double us = watch.microseconds(), update_us = barrier().update_us(),
                 query_us = barrier().query_us();
    report.update_us += update_us;
    report.collision_us += query_us;
    report.detect_us += us - update_us - query_us;
    detecting_us_ += us;
    return share;
}

/// The largest of share, share / 2, share / 4 ... at which the potential of the step is no higher than at v.
double World::search_apart(double dt, const Eigen::VectorXd& v, const Eigen::VectorXd& to, double share) {
    const auto potential = [&](double s) {
        const Eigen::VectorXd at_s = v + s * (to - v);
        double sum = barrier().energy(s);
        if (!std::isfinite(sum)) return sum;
        sum += barrier_solver_.friction_potential(at_s);
        for (int b = 0; b < body_count(); ++b) {
            const Loads outer = loads(at(b));
            sum += StepPotential(*at(b).elastic, start_of(at(b)), dt, outer,
                                 systems_[static_cast<std::size_t>(b)].elements())
                       .value(body_part(b, at_s));
        }
        return sum;
    };
    const double before = potential(0);
    for (int k = 0; k < max_halvings; ++k, share /= 2)
        if (potential(share) <= before + rounding * std::abs(before)) return share;
    return 0;
}

/// Why the end of a part must not be kept; empty: nothing intersects.
std::string World::end_intersections(double dt, const Eigen::VectorXd& v, WorldReport& report) {
    const std::vector<Nodes> nodes = nodes_after(dt, v);
    const Stopwatch watch;
    const std::vector<Intersection> found = barrier().intersections(nodes);
    barrier().move(nodes, nodes, 1);
    barrier().energy(0);
    report.least_distance = barrier().least_distance();
    const double us = watch.microseconds();
    report.detect_us += us;
    detecting_us_ += us;
    return found.empty() ? std::string() : intersection_text(found, barrier().surfaces());
}

}  // namespace nbd
