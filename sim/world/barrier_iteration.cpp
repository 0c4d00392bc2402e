// One part of a step without intersections: Newton's iteration over bodies that a barrier keeps apart.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "collision/base/stop.hpp"
#include "collision/base/stopwatch.hpp"
#include "sim/fem/step_system.hpp"
#include "sim/world/world.hpp"

namespace nbd {
namespace {

constexpr int max_linearisations = 100;  // unless the step's config allows several itself
/// Far from balance, normal forces are many times what they will be. Friction keeps those that it had until
/// impulses are out of balance by this share at most, and after so many linearisations for good, so that the
/// iteration has an end.
constexpr double near_balance = 0.1;
constexpr int friction_updates = 20;
constexpr int max_halvings = 40;            // of a Newton step, until the potential falls
constexpr double rounding = 1e-13;          // relative, of potentials
constexpr double least_progress = 1e-9;     // share of a Newton step that counts as motion
constexpr double rounding_of_sums = 1e-13;  // relative, of the momentum of bodies

constexpr const char* way_to_start = "; `resolve_start` moves bodies apart";

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
        throw std::invalid_argument(fmt::format("without intersections, the start must have none, but {}{}",
                                                intersection_text(found, barrier().surfaces()),
                                                way_to_start));
    barrier().move(nodes_now(), nodes_now(), 0);
    if (!std::isfinite(barrier().energy(0)))
        throw std::invalid_argument(fmt::format(
            "without intersections, surfaces must start apart, but the nearest are {:.2g} m apart; "
            "allowed: more than {:.2g} m{}",
            barrier().least_distance(), barrier().floor(), way_to_start));
    start_is_checked_ = true;
}

/// Where the iteration starts: as the body went before, or with the loads of the step in it. Which of both is
/// nearer to how its velocities changed in the last step tells: a body that rests has not felt its weight.
Nodes World::start_apart(const Body& body, double dt) const {
    const Nodes& v = body.state.v;
    Nodes change = Nodes::Zero(v.rows(), 3);
    if (body.forces.size() > 0)
        change = body.elastic->node_masses().cwiseInverse().asDiagonal() * body.forces;
    change.rowwise() += config_.gravity.transpose();
    if (body.velocities_before.size() > 0) {
        const Nodes last = (v - body.velocities_before) / dt_before_;
        const auto squared = [&](const Nodes& a) {
            return body.elastic->node_masses().dot(a.rowwise().squaredNorm());
        };
        if (squared(last) < squared(last - change)) return v;
    }
    return v + dt * change;
}

/// BarrierSolver::clusters() of bodies of which nothing is held; -1 for others.
std::vector<int> World::free_clusters() const {
    std::vector<int> clusters = barrier_solver_.clusters();
    for (std::size_t b = 0; b < bodies_.size(); ++b)
        if (std::ranges::any_of(systems_[b].prescribed(), [](char held) { return held != 0; })) {
            const int held = clusters[b];  // a copy: its place changes on the way
            std::ranges::replace(clusters, held, -1);
        }
    return clusters;
}

/// For each body the centre of mass of the bodies that it meets, or its own where something holds one.
std::vector<Eigen::Vector3d> World::cluster_centres(const std::vector<Eigen::Vector3d>& centres) const {
    const std::vector<int> clusters = free_clusters();
    std::vector<Eigen::Vector3d> result = centres, sums(bodies_.size(), Eigen::Vector3d::Zero());
    std::vector<double> mass(bodies_.size(), 0);
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
        if (clusters[b] < 0) continue;
        const std::size_t first = clusters[b];
        sums[first] += bodies_[b].elastic->mass() * (centres[b] - centres[first]);
        mass[first] += bodies_[b].elastic->mass();
    }
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
        if (clusters[b] < 0) continue;
        const std::size_t first = clusters[b];
        result[b] = centres[first] + sums[first] / mass[first];
    }
    return result;
}

/// For each body the velocity that brings the bodies that it holds together with (see
/// BarrierSolver::clusters()) into balance as a whole. Forces among these sum to zero whatever v is, so that
/// this is exact; and it changes no distance among them. Zero where something is held, or an obstacle met.
std::vector<Eigen::Vector3d> World::missing_velocities(double dt, const Eigen::VectorXd& v) const {
    const std::vector<int> clusters = free_clusters();
    std::vector<Eigen::Vector3d> missing(bodies_.size(), Eigen::Vector3d::Zero());
    std::vector<double> mass(bodies_.size(), 0);
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
        if (clusters[b] < 0) continue;
        const Body& body = bodies_[b];
        const double damped = 1 + dt * body.elastic->material().rayleigh_mass;
        const Nodes change = damped * body_part(b, v) - body.state.v;
        const std::size_t first = clusters[b];
        missing[first] +=
            dt * (body.elastic->mass() * config_.gravity + body.forces.colwise().sum().transpose()) -
            change.transpose() * body.elastic->node_masses();
        mass[first] += damped * body.elastic->mass();
    }
    for (std::size_t b = bodies_.size(); b-- > 0;) {  // the first of a cluster is the last to change
        if (clusters[b] < 0) continue;
        const std::size_t first = clusters[b];
        missing[b] = missing[first] / mass[first];
    }
    return missing;
}

/// Adds to v what missing_velocities() finds. Returns the largest of these relative to the velocities.
double World::add_missing_velocities(double dt, Eigen::VectorXd& v) const {
    const std::vector<Eigen::Vector3d> missing = missing_velocities(dt, v);
    double largest = 0;
    for (int b = 0; b < body_count(); ++b) {
        const Eigen::Vector3d& by = missing[b];
        Eigen::Map<Nodes> part(v.data() + first_unknown_[b], at(b).state.v.rows(), 3);
        part.rowwise() += by.transpose();
        if (!by.isZero(0)) largest = std::max(largest, by.norm() / part.rowwise().norm().maxCoeff());
    }
    return largest;
}

/// How far a body is from balance at v, the iterate that was linearised: the residual relative to the
/// impulses that act on its free nodes in the step, of loads and drag (damping by mass), elasticity and
/// contacts, all in the norm of the inverse mass; 0 if rounding alone may leave as much.
double World::imbalance(int b, double dt, const Eigen::VectorXd& v, const Eigen::VectorXd& contact_impulses,
                        const Eigen::VectorXd& rounding) const {
    const Body& body = at(b);
    const StepSystem& system = systems_[b];
    const Eigen::VectorXd& masses = body.elastic->node_masses();
    const Nodes residual = body_part(b, barrier_solver_.residual()), contact = body_part(b, contact_impulses);
    const Nodes v_of_body = body_part(b, v);
    const Nodes inertia = masses.asDiagonal() * (v_of_body - body.state.v),
                drag = masses.asDiagonal() * (dt * body.elastic->material().rayleigh_mass * v_of_body);
    const double size =
        std::max(body.state.x.cwiseAbs().maxCoeff(), (body.state.x + dt * v_of_body).cwiseAbs().maxCoeff());
    double missing = 0, of_loads = 0, of_elasticity = 0, of_contacts = 0, noise = 0;  // squared norms
    for (int i = 0; i < std::ssize(masses); ++i) {
        if (system.is_prescribed(i)) continue;
        const Eigen::RowVector3d load =
            dt * (masses[i] * config_.gravity.transpose() + body.forces.row(i)) - drag.row(i);
        const Eigen::RowVector3d elastic = residual.row(i) + inertia.row(i) - load - contact.row(i);
        missing += residual.row(i).squaredNorm() / masses[i];
        of_loads += load.squaredNorm() / masses[i];
        of_elasticity += elastic.squaredNorm() / masses[i];
        of_contacts += contact.row(i).squaredNorm() / masses[i];
        const double rounded = size * rounding[first_unknown_[b] / 3 + i];
        noise += rounded * rounded / masses[i];
    }
    if (missing <= noise) return 0;
    return std::sqrt(missing) / (std::sqrt(of_loads) + std::sqrt(of_elasticity) + std::sqrt(of_contacts));
}

/// That of the body that is farthest from balance at v.
World::Imbalance World::worst_imbalance(double dt, const Eigen::VectorXd& v) const {
    const Eigen::VectorXd contact = barrier_solver_.impulses(v), rounding = barrier_solver_.rounding();
    Imbalance worst;
    for (int b = 0; b < body_count(); ++b)
        if (const double share = imbalance(b, dt, v, contact, rounding); share > worst.share)
            worst = {share, b};
    return worst;
}

/// The contacts that rub, with their normal forces, and what friction remembers of them.
std::vector<FrictionContact> World::rubbing(std::span<const BarrierContact> contacts, double dt) const {
    std::vector<FrictionContact> rubbing;
    for (const BarrierContact& c : contacts) {
        if (c.turns || !(c.contact.friction > 0)) continue;
        rubbing.push_back({c.contact, -dt * c.slope});
        friction_memory_.recall(rubbing.back().contact, slip_length(dt));
    }
    return rubbing;
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
    Eigen::VectorXd to(first_unknown_.back());
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
        Eigen::Map<Nodes> start(to.data() + first_unknown_[b], bodies_[b].state.v.rows(), 3);
        start = start_apart(bodies_[b], dt);
        start(given[b].nodes, Eigen::all) = given[b].v;
    }
    v.setZero(first_unknown_.back());
    // How far grips and obstacles have come.
    double progress = barrier().obstacles_move() || std::ranges::any_of(given, moves) ? 0 : 1;
    double share = propose(dt, v, to, progress, report), moved = 0;
    progress = std::max(progress, share);
    barrier_solver_.begin_step(std::move(surfaces), first_unknown_, dt);
    const std::vector<BarrierContact> first = barrier().contacts(0);
    barrier_solver_.set_contacts(first, rubbing(first, dt));
    v = share * to;
    const int most = config_.step.newton_iterations > 1 ? config_.step.newton_iterations : max_linearisations;
    Rejection rejection;
    for (int k = 0;; ++k) {
        stop_if_asked();
        timed(report.assemble_us, [&] { build_systems(given, &v); });
        std::vector<BarrierContact> contacts = barrier().contacts(share);
        barrier_solver_.set_contacts(contacts);
        report.contacts = barrier_solver_.contact_count();
        to = v;
        barrier_solver_.linearise(systems_, 1 - progress, false, to);
        Imbalance worst;
        if (progress == 1) {
            worst = worst_imbalance(dt, v);
            if (worst.share <= near_balance && k < friction_updates) {
                std::vector<FrictionContact> friction = rubbing(contacts, dt);
                barrier_solver_.set_contacts(std::move(contacts), std::move(friction));
                to = v;
                barrier_solver_.linearise(systems_, 0, true, to);
                worst = worst_imbalance(dt, v);
            }
            if (worst.share == 0 || (k > 0 && worst.share <= config_.step.newton_tolerance)) break;
        }
        if (k == most || (k > 0 && share < least_progress)) {
            if (progress < 1)
                return {.reason = fmt::format("grips and obstacles cannot go {:.2g} of their way "
                                              "without an intersection",
                                              1 - progress),
                        .fatal = true};
            if (moved < least_progress) return {.reason = "the step finds no progress", .fatal = true};
            rejection = {
                .reason = fmt::format("Newton's iteration ends with impulses on body {} out of balance by "
                                      "{:.2g} of theirs, allowed: {:.2g}",
                                      worst.body, worst.share, config_.step.newton_tolerance),
                .trouble = StepTrouble::newton};
            break;
        }
        const LinearSolveReport solved = timed(report.solve_us, [&] { return barrier_solver_.solve(to); });
        if (!solved.fallback.empty())
            report.fallback = fmt::format("at {:.6g} s: {}", time_ + dt, solved.fallback);
        report.solver_converged = report.solver_converged && solved.converged;
        ++report.newton_iterations;
        report.solver_iterations += solved.iterations;
        add_missing_velocities(dt, to);
        const double free = propose(dt, v, to, progress, report);
        share = progress < 1 ? free : search_apart(dt, v, to, free);
        v += share * (to - v);
        progress = share == 1 ? 1 : progress + share * (1 - progress);
        moved = std::max(moved, share);
    }
    keep_momentum(dt, v, report);
    return rejection;
}

/// Brings free bodies into balance as a whole where no step of the iteration went its full way.
void World::keep_momentum(double dt, Eigen::VectorXd& v, WorldReport& report) {
    Eigen::VectorXd to = v;
    if (add_missing_velocities(dt, to) <= rounding_of_sums) return;
    if (propose(dt, v, to, 1, report) < 1) return;
    v = to;
    barrier_solver_.set_contacts(barrier().contacts(1));
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
double World::search_apart(double dt, const Eigen::VectorXd& v, const Eigen::VectorXd& to, double share) {
    const auto potentials = [&](double s) {  // of the barrier, friction and each body
        const Eigen::VectorXd at_s = v + s * (to - v);
        std::vector<double> terms{barrier().energy(s), barrier_solver_.friction_potential(at_s)};
        for (int b = 0; b < body_count() && std::isfinite(terms.front()); ++b) {
            const Loads outer = loads(at(b));
            terms.push_back(StepPotential(*at(b).elastic, start_of(at(b)), dt, outer, systems_[b].elements())
                                .value(body_part(b, at_s)));
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

/// Why the end of a part must not be kept; empty: nothing intersects.
std::string World::end_intersections(double dt, const Eigen::VectorXd& v, WorldReport& report) {
    const std::vector<Nodes> nodes = nodes_after(dt, v);
    const ScopedTimer timer(report.detect_us);
    const std::vector<Intersection> found = barrier().intersections(nodes);
    barrier().move(nodes, nodes, 1);
    barrier().energy(0);
    report.least_distance = barrier().least_distance();
    return found.empty() ? std::string() : intersection_text(found, barrier().surfaces());
}

}  // namespace nbd
