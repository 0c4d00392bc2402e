#include "sim/contact/contact_solver.hpp"

#include <algorithm>
#include <cmath>

namespace nbd {
namespace {

constexpr double pass_share = 0.1;  // share of the residual left by a pass before contacts are updated

}  // namespace

void ContactSolver::begin(std::span<const Contact> contacts, std::span<const ContactSurface* const> surfaces,
                          std::span<const int> first_unknown, const ContactConfig& config, double thickness,
                          double dt, const Eigen::VectorXd& v) {
    contacts_ = contacts;
    first_unknown_ = first_unknown;
    config_ = &config;
    thickness_ = thickness;
    dt_ = dt;
    terms_.clear();
    operators_.clear();
    for (std::size_t c = 0; c < contacts_.size(); ++c) {
        terms_.add(contacts_[c], surfaces, first_unknown_);
        operators_.push_back(terms_.coupling(c, Eigen::Matrix3d::Zero()));
    }
    push_.resize(contacts_.size());
    linearise(v);
}

/// Relative velocity of the contact's points, minus the wall's velocity.
Eigen::Vector3d ContactSolver::relative_velocity(std::size_t contact, const Eigen::VectorXd& v) const {
    return terms_.velocity(contact, v) - contacts_[contact].wall_velocity;
}

double ContactSolver::potential(const Eigen::VectorXd& v, const Eigen::VectorXd& friction_at) const {
    double sum = 0;
    for (std::size_t c = 0; c < contacts_.size(); ++c) {
        const double normal =
            normal_impulse(contacts_[c], *config_, thickness_, dt_, relative_velocity(c, friction_at));
        sum += contact_potential(contacts_[c], *config_, thickness_, dt_, normal, relative_velocity(c, v));
    }
    return sum;
}

Eigen::VectorXd ContactSolver::impulses(const Eigen::VectorXd& v) const {
    Eigen::VectorXd out = Eigen::VectorXd::Zero(v.size());
    for (std::size_t c = 0; c < operators_.size(); ++c) {
        if (!presses(c)) continue;
        terms_.add_impulse(c, push_[c] - operators_[c].A * terms_.velocity(c, v), true, out);
    }
    return out;
}

void ContactSolver::linearise(const Eigen::VectorXd& v) {
    released_.assign(contacts_.size(), 0);
    linearise(v, false);
}

/// keep_drag: contacts that already press keep their operator, including the drag of friction. One that lets
/// go and then presses again does so without friction, because its drag may be what pulls it away: it would
/// let go and press in turn.
void ContactSolver::linearise(const Eigen::VectorXd& v, bool keep_drag) {
    for (std::size_t c = 0; c < contacts_.size(); ++c) {
        const Eigen::Vector3d u = relative_velocity(c, v);
        Contact contact = contacts_[c];
        if (released_[c]) contact.friction = 0;
        const ContactImpulse impulse = contact_impulse(contact, *config_, thickness_, dt_, u);
        if (keep_drag && impulse.active() && presses(c)) continue;
        released_[c] = released_[c] || (keep_drag && presses(c));
        operators_[c].A = impulse.A;
        push_[c] = impulse.b + impulse.A * contacts_[c].wall_velocity;
    }
}

void ContactSolver::set_rhs(std::span<const StepSystem> systems) {
    rhs_.resize(first_unknown_.back());
    for (std::size_t b = 0; b < systems.size(); ++b)
        rhs_.segment(first_unknown_[b], systems[b].rhs().size()) = systems[b].rhs();
    for (std::size_t c = 0; c < operators_.size(); ++c) terms_.add_impulse(c, push_[c], false, rhs_);
}

/// Norm of the right-hand side over nodes that are not prescribed; entries of prescribed nodes have other
/// units.
double ContactSolver::free_norm(std::span<const StepSystem> systems) const {
    double squared = 0;
    for (std::size_t b = 0; b < systems.size(); ++b)
        for (int i = 0; i < systems[b].body().node_count(); ++i)
            if (!systems[b].is_prescribed(i))
                squared += rhs_.segment<3>(first_unknown_[b] + 3 * i).squaredNorm();
    return std::sqrt(squared);
}

ContactSolveReport ContactSolver::solve(std::span<const StepSystem> systems, Eigen::VectorXd& v) {
    ContactSolveReport report;
    terms_.hold(systems);
    const CoupledSystem system{systems, first_unknown_, terms_.all(), operators_};
    linear_.begin_matrices(system);
    set_rhs(systems);
    const double scale = free_norm(systems), exact = tolerance_ * scale;
    double goal = exact;
    report.settled = contacts_.empty();
    for (; report.passes < config_->iterations; ++report.passes) {
        const LinearSolveReport solved = linear_.solve(system, rhs_, goal, v);
        report.linear_iterations += solved.iterations;
        report.converged = report.converged && solved.converged;
        if (!solved.fallback.empty()) report.fallback = solved.fallback;
        if (contacts_.empty()) break;
        // Friction first uses the velocities before the step, is updated once with those after it, and is
        // then kept: it is near its fixed point, but reaching that would take many passes.
        linearise(v, report.passes > 0);
        set_rhs(systems);
        product_.resize(v.size());
        system.multiply(v, product_);
        const double left = (rhs_ - product_).norm();
        report.settled = left <= config_->tolerance * scale;
        if (report.settled) break;
        goal = std::max(exact, pass_share * left);
    }
    for (std::size_t c = 0; c < contacts_.size(); ++c) report.active += presses(c);
    return report;
}

}  // namespace nbd
