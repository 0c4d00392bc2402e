// Static increments: the pose in which all forces on the bodies are in balance.
#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "collision/base/stop.hpp"
#include "collision/base/stopwatch.hpp"
#include "sim/fem/step_system.hpp"
#include "sim/world/given_ways.hpp"
#include "sim/world/joint_forces.hpp"
#include "sim/world/part_solve.hpp"
#include "sim/world/step_loads.hpp"
#include "sim/world/time_rule.hpp"

namespace nbd {
namespace {

constexpr double free_way = 0.5;    // of its size, by which a body that nothing holds moves at a time
constexpr double most_way = 4;      // of its room, in all, before it is taken to be held by nothing
constexpr double least_net = 0.01;  // of the forces on a body, with which it moves off
// Of the stiffness of a body: with what it is kept in place, where some of its nodes are held or none.
constexpr double held_hold = 1e-10, free_hold = 1e-7;
constexpr double least_tangents = 0.1;   // imbalance below which friction has its tangents
constexpr double least_step = 1e-9;      // share of a linearisation that counts as motion
constexpr double cautious_share = 0.25;  // of a linearisation, below which the next goes less far

/// Masses that a static solve takes are powers of this: a preconditioner is made for each of them.
double rounded(double share) noexcept {
    constexpr double digits = 2;
    return std::exp2(digits * std::round(std::log2(share) / digits));
}

/// Sum of the elastic forces on the free nodes of a body at rest, newtons.
double inner_sum(const ElasticBody& elastic, const BodyState& state, const PrescribedNodes& given) {
    Nodes forces = elastic.inner_forces(state.x, state.v);
    for (const int node : given.nodes) forces.row(node).setZero();
    return forces.rowwise().norm().sum();
}

}  // namespace

void check_static_config(const StaticConfig& config) {
    if (!(config.tolerance >= 1e-10 && config.tolerance <= 0.1))
        throw std::invalid_argument(fmt::format(
            "world: the tolerance of statics is {}, but must be between 1e-10 and 0.1", config.tolerance));
    if (config.newton_iterations < 1)
        throw std::invalid_argument(
            fmt::format("world: the linearisations of a static increment are {}, but must be 1 or more",
                        config.newton_iterations));
}

/// Of all bodies at v, with the contacts and bonds found there, which are linearised at v. is_assembled:
/// whether the systems are of this increment, so that they tell what rounding leaves.
std::vector<PartSolve::Imbalance> PartSolve::imbalances(const Eigen::VectorXd& v,
                                                        const std::vector<PrescribedNodes>& given,
                                                        bool is_assembled) {
    constexpr double unit = 4 * std::numeric_limits<double>::epsilon();
    equations_.solver.linearise(v);
    const Eigen::VectorXd pushes = equations_.solver.impulses(v);
    std::vector<Imbalance> all(world_.bodies.size());
    for (int b = 0; b < world_.body_count(); ++b) {
        SteppedBody& body = world_.at(b);
        Imbalance& of = all[b];
        const Nodes w = world_.part_of(b, v), x = body.start.x + dt_ * w,
                    push = world_.part_of(b, pushes) / dt_;
        set_end_forces(world_, body, x);
        linearise_loads(world_, body, w);
        const Loads outer = end_loads(world_, body);
        StepStart here = body.start;  // without resistance of its mass
        here.v = w;
        here.static_mass = 0;
        const StepSystem& system = equations_.systems[b];
        const Nodes off =
            push - StepPotential(*body.elastic, here, dt_, outer, system.elements()).gradient(w) / dt_;
        std::vector<char> is_given(x.rows(), 0);
        for (const int node : given[b].nodes) is_given[node] = 1;
        const Eigen::RowVector3d centre = centre_of_mass(*body.elastic, x);
        Eigen::Vector3d force = Eigen::Vector3d::Zero(), torque = Eigen::Vector3d::Zero();
        double loads = 0, supports = 0;
        const auto& diagonal = system.matrix().diagonal();
        for (Eigen::Index i = 0; i < x.rows(); ++i) {
            const Eigen::Vector3d left = off.row(i), arm = x.row(i) - centre;
            supports += push.row(i).norm();
            if (is_given[i]) {
                supports += left.norm();
                continue;
            }
            of.off += left.norm();
            if (is_assembled) of.rounding += unit * diagonal[i].norm() / (dt_ * dt_) * x.row(i).norm();
            force += left;
            torque += arm.cross(left);
            loads +=
                (body.elastic->node_masses()[i] * outer.gravity.transpose() + outer.forces.row(i)).norm();
        }
        of.scale = std::max(loads, supports);
        const Eigen::Matrix3d inertia = rigid_inertia(*body.elastic, x).bottomRightCorner<3, 3>();
        of.net = force.norm() +
                 2 * body.elastic->mass() * inertia.ldlt().solve(torque).norm() * body.shape->rest_diagonal;
    }
    return all;
}

/// Takes the next linearisations more carefully after one whose matrix was not positive definite. Returns
/// whether that can help.
bool PartSolve::Caution::takes_more_hold(bool was_exact, double imbalance) noexcept {
    constexpr double factor = 100, most = 1e6;
    if (was_exact) {
        exact_below = exact_again * imbalance;
        return true;
    }
    stiffness_hold *= factor;
    return stiffness_hold <= most;
}

/// Lets the next linearisation be solved better after one whose solution was taken to be where it began: what
/// solves may leave counts by the whole motion of the increment. Returns whether that can help.
bool PartSolve::Caution::solves_better() noexcept {
    constexpr double factor = 1e-2, least = 1e-8;
    precision *= factor;
    return precision >= least;
}

/// Likewise after one that went far or not. Returns whether the next can go on.
bool PartSolve::Caution::goes_on(bool was_exact, double imbalance, bool went_far) noexcept {
    constexpr double factor = 16, most = 1e12;
    if (went_far)
        way_hold = std::max(4 * way_hold / factor, 1.0);
    else if (was_exact)
        exact_below = exact_again * imbalance;
    else
        way_hold *= factor;
    return way_hold <= most;
}

/// Lets a share of each body's mass resist the motion from v, so that one that nothing holds does not move
/// too far at a time, however far linearisations lead. As it resists what is not balanced yet, it vanishes
/// with that: at the end the bodies are in balance without it.
void PartSolve::regularise(const Eigen::VectorXd& v, std::span<const Imbalance> imbalances,
                           const Caution& caution) {
    for (int b = 0; b < world_.body_count(); ++b) {
        SteppedBody& body = world_.at(b);
        const double size = body.shape->rest_diagonal,
                     hold = std::max(caution.way_hold * imbalances[b].net / (free_way * size),
                                     caution.stiffness_hold * (world_.is_held(body) ? held_hold : free_hold) *
                                         body.contact_young * size);  // N/m
        body.start.v = world_.part_of(b, v);
        body.start.static_mass = rounded(dt_ * dt_ * hold / body.elastic->mass());
    }
}

/// How far a body may have to go before something holds it, metres: the largest of its size and of its
/// distances from other bodies, obstacles and the places of its joints.
double PartSolve::room_of(int body) const {
    const double size = world_.at(body).shape->rest_diagonal;
    const Eigen::Vector3d centre = centre_of_mass(*world_.at(body).elastic, world_.at(body).state.x);
    double room = size;
    for (int b = 0; b < world_.body_count(); ++b)
        if (b != body)
            room =
                std::max(room, (centre_of_mass(*world_.at(b).elastic, world_.at(b).state.x) - centre).norm());
    for (const Obstacle& obstacle : world_.obstacles)
        if (const auto to = signed_distance(as_at(obstacle, world_.time), centre, world_.time,
                                            std::numeric_limits<double>::infinity()))
            room = std::max(room, std::abs(to->distance));
    for (const JointBonds& joint : world_.joints)
        if (joint.joint().a == body || joint.joint().b == body)
            room = std::max(room, joint.reach_from(centre));
    return room;
}

/// An increment: Newton's iteration to the balance of all forces, with friction by the way of the increment.
/// The first linearisations take grips and obstacles along their ways. v: out, the way of the increment over
/// its length.
Rejection PartSolve::balance(Eigen::VectorXd& v, WorldReport& report) {
    std::vector<const ContactShape*>& shapes = equations_.shapes;
    shapes.clear();
    std::vector<PrescribedNodes> given;
    std::vector<double> begun;  // what a body has to let go of where its load goes back to nothing
    for (const SteppedBody& body : world_.bodies) {
        shapes.push_back(body.shape.get());
        given.push_back(world_.prescribed(body, dt_));
        begun.push_back(inner_sum(*body.elastic, body.state, given.back()));
    }
    equations_.steps = world_.steps();
    barrier_.begin_step(world_.time, dt_);
    Eigen::VectorXd to = stacked(&first_iterate, given);
    v = Eigen::VectorXd::Zero(to.size());
    GivenWays given_ways(barrier_.obstacles_move() || held_nodes_move(given));
    look(v, to, given_ways.obstacles, report);
    std::vector<double> ways(world_.bodies.size(), 0.0);  // of their nodes in the mean
    std::vector<double> rooms;
    for (int b = 0; b < world_.body_count(); ++b) rooms.push_back(room_of(b));
    Caution caution;
    std::string left;
    double share = 0;
    for (int k = 0;; ++k) {
        stop_if_asked();
        timed(report.detect_us, "detect",
              [&] { equations_.contacts = contacts_at(v, share, given_ways.obstacles, shapes); });
        find_bonds(v);
        // Far from balance, friction of a size that does not change with the slip would push bodies away.
        equations_.solver.begin(equations_.contacts, equations_.bonds, shapes, world_.first_unknown,
                                world_.config.contact.tolerance, equations_.steps, v, true,
                                k > 0 && report.imbalance < least_tangents);
        equations_.solver.solve_to(caution.precision);
        std::vector<Imbalance> now =
            timed(report.assemble_us, "assemble", [&] { return imbalances(v, given, k > 0); });
        for (std::size_t b = 0; b < now.size(); ++b) now[b].scale = std::max(now[b].scale, begun[b]);
        const double tolerance = world_.config.statics->tolerance;
        const std::size_t worst =
            std::ranges::max_element(now, {}, [&](const Imbalance& of) { return of.share(tolerance); }) -
            now.begin();
        report.imbalance = now[worst].share(tolerance);
        left = fmt::format("{} is out of balance by {:.2g} of the forces on it", world_.bodies[worst].name,
                           report.imbalance);
        if (now[worst].net > least_net * now[worst].scale) left += ", and maybe nothing holds it";
        if (k > 0 && given_ways.are_gone() && report.imbalance <= tolerance) {
            report.contacts_settled = report.solver_converged = true;
            return {};
        }
        if (ways[worst] > most_way * rooms[worst] && now[worst].net > least_net * now[worst].scale)
            return {.reason = fmt::format("nothing holds {}, which moves on and on without a balance",
                                          world_.bodies[worst].name),
                    .fatal = true,
                    .is_final = true};
        if (k == world_.config.step.newton_iterations) break;
        const bool is_exact = report.imbalance < caution.exact_below;
        regularise(v, now, caution);
        timed(report.assemble_us, "assemble",
              [&] { build_systems(given, &v, is_exact ? Tangent::exact : Tangent::full); });
        to = v;
        ++report.newton_iterations;
        try {
            const ContactSolveReport solved = timed(
                report.solve_us, "solve", [&] { return tendons_.solve(world_, equations_, gases_, to); });
            report.contacts = solved.active;
            report.solver_iterations += solved.linear_iterations;
            if (given_ways.are_gone() && solved.linear_iterations == 0 && to == v && !caution.solves_better())
                break;
        } catch (const std::runtime_error&) {  // the matrix is not positive definite
            if (!caution.takes_more_hold(is_exact, report.imbalance)) throw;
            continue;
        }
        if (!to.allFinite()) return {.reason = "the motion of the increment is not finite", .fatal = true};
        const double trusted = trusted_share(v, to);
        if (trusted < 1) to = v + trusted * (to - v);
        const double free = propose(v, to, given_ways.obstacles, report);
        const bool is_free = given_ways.are_gone();
        share = is_free ? search_line(v, to, free) : free;
        if (is_free && !caution.goes_on(is_exact, report.imbalance, share >= cautious_share * free)) break;
        if (!is_free && share < least_step) break;
        for (int b = 0; b < world_.body_count(); ++b)
            if (is_free) ways[b] += dt_ * share * world_.part_of(b, to - v).rowwise().norm().mean();
        v += share * (to - v);
        given_ways.go(share, trusted);
    }
    if (!given_ways.are_gone()) return {.reason = given_ways.text(), .fatal = true};
    return {.reason = left, .fatal = true, .trouble = StepTrouble::newton};
}

}  // namespace nbd
