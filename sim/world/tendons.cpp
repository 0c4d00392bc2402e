// Tendons of given lengths. Such a cord is a spring of one unknown, its tension, that all of its parts share.
// It is solved for beside the system: each try is a solve with the tensions given, and the secant of how the
// lengths answer leads to the next one.
#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <utility>

#include "sim/fem/momentum.hpp"
#include "sim/world/world.hpp"

namespace nbd {

void World::add_tendon(Tendon tendon) {
    if (config_.statics) throw std::invalid_argument("tendon: statics know no winch");
    if (tendon.parts.empty()) throw std::invalid_argument("tendon: it has no parts");
    for (const int part : tendon.parts) {
        if (part < 0 || part >= joint_count())
            throw std::invalid_argument(
                fmt::format("tendon: joint {} is not one of {}", part, joint_count()));
        const auto* cord = std::get_if<CordJoint>(&joint(part).kind);
        if (!cord || cord->tension.empty() || tendon_of(part) >= 0)
            throw std::invalid_argument(fmt::format(
                "tendon: joint \"{}\" is no cord with a given tension of its own", joint(part).name));
    }
    const auto& [times, lengths] = tendon.winch;
    bool is_right = !times.empty() && times.size() == lengths.size();
    for (std::size_t k = 0; is_right && k < times.size(); ++k)
        is_right = std::isfinite(times[k]) && std::isfinite(lengths[k]) && lengths[k] > 0 &&
                   (k == 0 || times[k] > times[k - 1]);
    if (!is_right) throw std::invalid_argument("tendon: its winch needs lengths > 0 at times that increase");
    if (!(tendon.stiffness >= 0) || !std::isfinite(tendon.stiffness) || !(tendon.fixed >= 0))
        throw std::invalid_argument("tendon: it needs a stiffness >= 0");
    tendons_.push_back(std::move(tendon));
}

/// The tendon that a joint is a part of; -1: none.
int World::tendon_of(int joint) const {
    for (std::size_t t = 0; t < tendons_.size(); ++t)
        if (std::ranges::find(tendons_[t].parts, joint) != tendons_[t].parts.end())
            return static_cast<int>(t);
    return -1;
}

/// Its tension at the end of the part with the nodes at x, newtons; below zero where it is slack, since
/// secants need a function without a kink.
double World::taut_tension(std::size_t tendon, std::span<const Nodes> x) const {
    const Tendon& one = tendons_[tendon];
    double length = one.fixed;
    for (const int part : one.parts) length += joints_[part].value(x);
    return tendon_stiffness_[tendon] * (length - one.winch.at(time_ + step_.dt, 0));
}

/// Sets the bonds of tendons in a step of length dt, with the tensions that were solved for last.
void World::find_tensions(double dt) {
    tendon_stiffness_.clear();
    for (const Tendon& tendon : tendons_) {
        double firmness = tendon.stiffness;
        for (const int part : tendon.parts)
            if (tendon.stiffness == 0)
                firmness = firmness == 0 ? joints_[part].firmness(dt)
                                         : std::min(firmness, joints_[part].firmness(dt));
        tendon_stiffness_.push_back(firmness);
    }
    set_tensions(tensions_);
}

/// Their whole impulses act in the step, as those of ropes do.
void World::set_tensions(const Eigen::VectorXd& tensions) {
    tensions_ = tensions;
    for (Bond& bond : bonds_)
        if (const int tendon = tendon_of(bond.joint); tendon >= 0) {
            bond.law.tension = step_.velocity_factor * tensions[tendon];
            bond.is_spring = false;
        }
}

/// By how much a tension that is tried is wrong more than it is changed, as if each body that it pulls gave
/// way as a whole, and if it deforms each of its nodes alone, too.
Eigen::MatrixXd World::first_tendon_response() const {
    using Pull = std::map<int, Eigen::Vector3d>;              // on nodes
    std::vector<std::map<int, Pull>> pulls(tendons_.size());  // on bodies
    for (const Bond& bond : bonds_) {
        const int tendon = tendon_of(bond.joint);
        if (tendon < 0 || bond.difference.isZero(0)) continue;
        const Eigen::Vector3d e = bond.difference.normalized();
        for (const auto& [point, sign] : {std::pair(&bond.a, 1.0), std::pair(&bond.b, -1.0)})
            for (std::size_t k = 0; k < point->nodes.size(); ++k)
                pulls[tendon][point->body]
                    .try_emplace(point->nodes[k], Eigen::Vector3d::Zero())
                    .first->second += sign * point->weights[k] * e;
    }
    const double c = step_.velocity_factor;
    Eigen::MatrixXd response = Eigen::MatrixXd::Identity(std::ssize(tendons_), std::ssize(tendons_));
    for (std::size_t t = 0; t < tendons_.size(); ++t) {
        double softness = 0;  // 1/kg
        for (const auto& [index, pull] : pulls[t]) {
            const Body& body = at(index);
            const StepSystem& system = systems_[index];
            RigidVector whole = RigidVector::Zero();
            const Eigen::Vector3d centre = centre_of_mass(*body.elastic, body.state.x);
            for (const auto& [node, force] : pull) {
                if (system.is_prescribed(node)) continue;
                whole.head<3>() += force;
                whole.tail<3>() += (body.state.x.row(node).transpose() - centre).cross(force);
                if (!body.elastic->is_rigid())
                    softness += force.squaredNorm() / (system.matrix().diagonal()[node].trace() / 3);
            }
            if (!is_held(body))
                softness +=
                    whole.dot(rigid_inertia(*body.elastic, body.state.x).ldlt().solve(whole)) / (c * c);
        }
        response(t, t) += tendon_stiffness_[t] * c * step_.dt * step_.dt * softness;
    }
    return response;
}

/// Solves the systems of the step with the tensions that tendons have at its solution.
ContactSolveReport World::solve_systems(Eigen::VectorXd& v) {
    if (tendons_.empty()) return solve_with_gases(v);
    constexpr double of_tensions = 1e-4, poor = 100;
    const int most = 8 + 2 * static_cast<int>(tendons_.size());
    Eigen::MatrixXd response = first_tendon_response();
    Eigen::VectorXd off, way;
    ContactSolveReport all;
    for (int round = 1;; ++round) {
        if (round > 1) solver_.renew_bonds(v);
        ContactSolveReport report = solve_with_gases(v);
        report.linear_iterations += all.linear_iterations;
        report.passes += all.passes;
        if (report.fallback.empty()) report.fallback = all.fallback;
        all = std::move(report);
        const std::vector<Nodes> x = nodes_after(step_.dt, v);
        Eigen::VectorXd found(tensions_.size());
        for (std::size_t t = 0; t < tendons_.size(); ++t) found[t] = taut_tension(t, x);
        const Eigen::VectorXd before = std::exchange(off, tensions_ - found);
        if (round == 2) {  // each by its own secant
            for (Eigen::Index t = 0; t < way.size(); ++t)
                if (way[t] != 0) response(t, t) = std::max(1.0, (off[t] - before[t]) / way[t]);
        } else if (round > 2 && way.squaredNorm() > 0) {  // [Broyden65]
            response += (off - before - response * way) * way.transpose() / way.squaredNorm();
        }
        const Eigen::VectorXd next = (tensions_ - response.partialPivLu().solve(off)).cwiseMax(0);
        way = next - tensions_;
        const double largest = std::max(tensions_.maxCoeff(), next.maxCoeff()),
                     share = largest > 0 ? way.cwiseAbs().maxCoeff() / (of_tensions * largest) : 0;
        if (share <= 1) return all;
        if (round == most) {
            all.converged = all.converged && share <= poor;
            return all;
        }
        set_tensions(next);
    }
}

}  // namespace nbd
