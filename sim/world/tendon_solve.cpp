#include "sim/world/tendon_solve.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <utility>

#include "sim/fem/momentum.hpp"
#include "sim/world/secant.hpp"

namespace nbd {

/// Its tension at the end of the part with the nodes at x, newtons; below zero where it is slack, since
/// secants need a function without a kink.
double TendonSolve::taut_tension(const WorldState& world, std::size_t tendon,
                                 std::span<const Nodes> x) const {
    const Tendon& one = world.tendons[tendon];
    double length = one.fixed;
    for (const int part : one.parts) length += world.joints[part].value(x);
    return stiffness_[tendon] * (length - one.winch.at(world.end(), 0));
}

void TendonSolve::bind(const WorldState& world, std::vector<Bond>& bonds) {
    stiffness_.clear();
    for (const Tendon& tendon : world.tendons) {
        double firmness = tendon.stiffness;
        for (const int part : tendon.parts)
            if (tendon.stiffness == 0)
                firmness = firmness == 0 ? world.joints[part].firmness(world.dt)
                                         : std::min(firmness, world.joints[part].firmness(world.dt));
        stiffness_.push_back(firmness);
    }
    pull(world, tensions_, bonds);
}

void TendonSolve::pull(const WorldState& world, const Eigen::VectorXd& tensions, std::vector<Bond>& bonds) {
    tensions_ = tensions;
    for (Bond& bond : bonds)
        if (const int tendon = world.tendon_of(bond.joint); tendon >= 0) {
            bond.law.tension = tensions[tendon];
            bond.is_spring = false;
        }
}

/// By how much a tension that is tried is wrong more than it is changed, as if each body that it pulls gave
/// way as a whole, and if it deforms each of its nodes alone, too.
Eigen::MatrixXd TendonSolve::first_response(const WorldState& world, const StepEquations& equations) const {
    const auto& [systems, steps, shapes, contacts, bonds, solver, are_balanced] = equations;
    using Pull = std::map<int, Eigen::Vector3d>;                   // on nodes
    std::vector<std::map<int, Pull>> pulls(world.tendons.size());  // on bodies
    for (const Bond& bond : bonds) {
        const int tendon = world.tendon_of(bond.joint);
        if (tendon < 0 || bond.difference.isZero(0)) continue;
        const Eigen::Vector3d e = bond.difference.normalized();
        for (const auto& [point, sign] : {std::pair(&bond.a, 1.0), std::pair(&bond.b, -1.0)})
            for (std::size_t k = 0; k < point->nodes.size(); ++k)
                pulls[tendon][point->body]
                    .try_emplace(point->nodes[k], Eigen::Vector3d::Zero())
                    .first->second += sign * point->weights[k] * e;
    }
    /// Of a tendon on a body.
    struct Whole {
        const Pull* pull;
        RigidVector impulse;
    };
    std::vector<std::map<int, Whole>> wholes(world.tendons.size());
    for (std::size_t t = 0; t < world.tendons.size(); ++t)
        for (const auto& [index, pull] : pulls[t]) {
            const SteppedBody& body = world.at(index);
            const Eigen::Vector3d centre = centre_of_mass(*body.elastic, body.state.x);
            Whole& whole = wholes[t].emplace(index, Whole{&pull, RigidVector::Zero()}).first->second;
            for (const auto& [node, force] : pull) {
                if (systems[index].is_prescribed(node)) continue;
                whole.impulse.head<3>() += force;
                whole.impulse.tail<3>() += (body.state.x.row(node).transpose() - centre).cross(force);
            }
        }
    Eigen::MatrixXd response =
        Eigen::MatrixXd::Identity(std::ssize(world.tendons), std::ssize(world.tendons));
    for (std::size_t t = 0; t < world.tendons.size(); ++t)
        for (std::size_t other = 0; other < world.tendons.size(); ++other) {
            double softness = 0;  // 1/kg, of where the one is pulled to where the other pulls
            for (const auto& [index, whole] : wholes[t]) {
                const auto shared = wholes[other].find(index);
                if (shared == wholes[other].end()) continue;
                const SteppedBody& body = world.at(index);
                const StepSystem& system = systems[index];
                if (!body.elastic->is_rigid())
                    for (const auto& [node, force] : *whole.pull) {
                        const auto on_node = shared->second.pull->find(node);
                        if (on_node == shared->second.pull->end() || system.is_prescribed(node)) continue;
                        softness +=
                            force.dot(on_node->second) / (system.matrix().diagonal()[node].trace() / 3);
                    }
                if (!world.is_held(body))
                    softness +=
                        whole.impulse.dot(
                            rigid_inertia(*body.elastic, body.state.x).ldlt().solve(shared->second.impulse)) /
                        body.velocity_factor;
            }
            response(t, other) += stiffness_[t] * world.dt * world.dt * softness;
        }
    return response;
}

ContactSolveReport TendonSolve::solve(WorldState& world, StepEquations& equations, GasSolve& gases,
                                      Eigen::VectorXd& v) {
    if (world.tendons.empty()) return gases.solve(world, equations, v);
    constexpr double of_tensions = 1e-4, poor = 100;
    const int most = 8 + 2 * static_cast<int>(world.tendons.size());
    Secant secant(first_response(world, equations));
    ContactSolveReport all;
    for (int round = 1;; ++round) {
        if (round > 1) equations.solver.renew_bonds(v);
        all.add_round(gases.solve(world, equations, v));
        const std::vector<Nodes> x = world.nodes_after(world.dt, v);
        Eigen::VectorXd found(tensions_.size());
        for (std::size_t t = 0; t < world.tendons.size(); ++t) found[t] = taut_tension(world, t, x);
        const Eigen::VectorXd next = (tensions_ + secant.way_from(tensions_ - found)).cwiseMax(0),
                              way = next - tensions_;
        secant.went(way);
        const double largest = std::max(tensions_.maxCoeff(), next.maxCoeff()),
                     share = largest > 0 ? way.cwiseAbs().maxCoeff() / (of_tensions * largest) : 0;
        if (share <= 1) return all;
        if (round == most) {
            all.converged = all.converged && share <= poor;
            return all;
        }
        pull(world, next, equations.bonds);
    }
}

}  // namespace nbd
