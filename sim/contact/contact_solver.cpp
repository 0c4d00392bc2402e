#include "sim/contact/contact_solver.hpp"

#include <algorithm>
#include <cmath>

namespace nbd {
namespace {

constexpr double pass_share = 0.1;  // share of the residual left by a pass before contacts are updated

}  // namespace

std::span<const CouplingTerm> ContactSolver::terms(int begin, int end) const {
    return std::span(terms_).subspan(static_cast<std::size_t>(begin), static_cast<std::size_t>(end - begin));
}

/// Appends the terms of a point. Returns the new number of terms.
int ContactSolver::add_terms(const SurfacePoint& point, double sign,
                             std::span<const ContactSurface* const> surfaces) {
    const auto begin = static_cast<std::ptrdiff_t>(terms_.size());
    for (std::size_t k = 0; k < static_cast<std::size_t>(point.count); ++k) {
        const auto body = static_cast<std::size_t>(point.body);
        for (Embedding::InnerIterator entry(surfaces[body]->W(), point.vertices[k]); entry; ++entry) {
            const double weight = sign * point.weights[k] * entry.value();
            const int node = static_cast<int>(entry.col());
            if (weight == 0) continue;
            const auto known = std::find_if(terms_.begin() + begin, terms_.end(),
                                            [&](const CouplingTerm& t) { return t.node == node; });
            if (known != terms_.end())
                known->weight += weight;
            else
                terms_.push_back({point.body, node, first_unknown_[body] + 3 * node, weight, false});
        }
    }
    return static_cast<int>(terms_.size());
}

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
    for (const Contact& contact : contacts_) {
        Coupling range{.begin = static_cast<int>(terms_.size())};
        add_terms(contact.a, 1, surfaces);
        range.end = add_terms(contact.b, -1, surfaces);
        operators_.push_back(range);
    }
    push_.resize(contacts_.size());
    linearise(v);
}

Eigen::Vector3d ContactSolver::velocity(int begin, int end, const Eigen::VectorXd& v) const {
    Eigen::Vector3d u = Eigen::Vector3d::Zero();
    for (const CouplingTerm& t : terms(begin, end)) u += t.weight * v.segment<3>(t.unknown);
    return u;
}

/// Relative velocity of the contact's points, minus the wall's velocity.
Eigen::Vector3d ContactSolver::relative_velocity(std::size_t contact, const Eigen::VectorXd& v) const {
    const Coupling& range = operators_[contact];
    return velocity(range.begin, range.end, v) - contacts_[contact].wall_velocity;
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
        const Coupling& contact = operators_[c];
        const Eigen::Vector3d p = push_[c] - contact.A * velocity(contact.begin, contact.end, v);
        for (const CouplingTerm& t : terms(contact.begin, contact.end))
            out.segment<3>(t.unknown) += t.weight * p;
    }
    return out;
}

void ContactSolver::linearise(const Eigen::VectorXd& v) { linearise(v, false); }

/// keep_drag: contacts that already press keep their operator, including the drag of friction.
void ContactSolver::linearise(const Eigen::VectorXd& v, bool keep_drag) {
    for (std::size_t c = 0; c < contacts_.size(); ++c) {
        const Eigen::Vector3d u = relative_velocity(c, v);
        const ContactImpulse impulse = contact_impulse(contacts_[c], *config_, thickness_, dt_, u);
        if (keep_drag && impulse.active() && presses(c)) continue;
        operators_[c].A = impulse.A;
        push_[c] = impulse.b + impulse.A * contacts_[c].wall_velocity;
    }
}

void ContactSolver::set_rhs(std::span<const StepSystem> systems) {
    rhs_.resize(first_unknown_.back());
    for (std::size_t b = 0; b < systems.size(); ++b)
        rhs_.segment(first_unknown_[b], systems[b].rhs().size()) = systems[b].rhs();
    for (std::size_t c = 0; c < operators_.size(); ++c)
        for (const CouplingTerm& t : terms(operators_[c].begin, operators_[c].end))
            if (!t.held) rhs_.segment<3>(t.unknown) += t.weight * push_[c];
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
    for (CouplingTerm& t : terms_) t.held = systems[static_cast<std::size_t>(t.body)].is_prescribed(t.node);
    const CoupledSystem system{systems, first_unknown_, terms_, operators_};
    linear_.begin_matrices(system);
    set_rhs(systems);
    const double scale = free_norm(systems), exact = tolerance_ * scale;
    double goal = exact;
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
        if (left <= config_->tolerance * scale) break;
        goal = std::max(exact, pass_share * left);
    }
    for (std::size_t c = 0; c < contacts_.size(); ++c) report.active += presses(c);
    return report;
}

}  // namespace nbd
