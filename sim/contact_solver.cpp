#include "sim/contact_solver.hpp"

#include <algorithm>
#include <cmath>

namespace nbd {

std::span<const CouplingTerm> ContactSolver::terms(int begin, int end) const {
    return std::span(terms_).subspan(static_cast<std::size_t>(begin), static_cast<std::size_t>(end - begin));
}

/// Returns the end of the terms.
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

void ContactSolver::linearise(const Eigen::VectorXd& v) {
    for (std::size_t c = 0; c < contacts_.size(); ++c) {
        const Eigen::Vector3d u =
            velocity(operators_[c].begin, operators_[c].end, v) - contacts_[c].wall_velocity;
        const ContactImpulse impulse = contact_impulse(contacts_[c], *config_, thickness_, dt_, u);
        operators_[c].A = impulse.A;
        push_[c] = impulse.b + impulse.A * contacts_[c].wall_velocity;
    }
}

Eigen::VectorXd ContactSolver::impulses(const Eigen::VectorXd& v) const {
    Eigen::VectorXd out = Eigen::VectorXd::Zero(v.size());
    for (std::size_t c = 0; c < operators_.size(); ++c) {
        const Coupling& contact = operators_[c];
        if (contact.A.isZero(0)) continue;
        const Eigen::Vector3d p = push_[c] - contact.A * velocity(contact.begin, contact.end, v);
        for (const CouplingTerm& t : terms(contact.begin, contact.end))
            out.segment<3>(t.unknown) += t.weight * p;
    }
    return out;
}

void ContactSolver::set_rhs(std::span<const StepSystem> systems) {
    rhs_.resize(first_unknown_.back());
    for (std::size_t b = 0; b < systems.size(); ++b)
        rhs_.segment(first_unknown_[b], systems[b].rhs().size()) = systems[b].rhs();
    for (std::size_t c = 0; c < operators_.size(); ++c)
        for (const CouplingTerm& t : terms(operators_[c].begin, operators_[c].end))
            if (!t.held) rhs_.segment<3>(t.unknown) += t.weight * push_[c];
}

std::vector<bool> ContactSolver::pressing() const {
    std::vector<bool> set;
    for (const Coupling& contact : operators_) set.push_back(!contact.A.isZero(0));
    return set;
}

ContactSolveReport ContactSolver::solve(std::span<const StepSystem> systems, Eigen::VectorXd& v) {
    ContactSolveReport report;
    for (CouplingTerm& t : terms_) t.held = systems[static_cast<std::size_t>(t.body)].is_prescribed(t.node);
    const CoupledSystem system{systems, first_unknown_, terms_, operators_};
    linear_.begin_matrices(system);
    std::vector<bool> pressed = pressing();
    for (bool settled = false; !settled && report.passes < config_->iterations;) {
        const bool first = report.passes == 0;
        set_rhs(systems);
        const LinearSolveReport solved = linear_.solve(system, rhs_, v);
        report.linear_iterations += solved.iterations;
        report.patch_nodes = std::max(report.patch_nodes, solved.patch_nodes);
        report.converged = report.converged && solved.converged;
        if (!solved.fallback.empty()) report.fallback = solved.fallback;
        ++report.passes;
        linearise(v);
        std::vector<bool> pressing_now = pressing();
        // Friction is first guessed from the velocities before the step, so one repetition is due in any
        // case.
        settled = contacts_.empty() || (!first && pressing_now == pressed);
        pressed.swap(pressing_now);
    }
    report.active = static_cast<int>(std::ranges::count(pressed, true));
    return report;
}

}  // namespace nbd
