#include "sim/contact_solver.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <ranges>

namespace nbd {
namespace {

constexpr int most_iterations = 300;
constexpr int stale_iterations = 20;  // a factorisation costs about as much as this many of them

}  // namespace

std::span<const ContactSolver::Term> ContactSolver::terms(int begin, int end) const {
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
                                            [&](const Term& t) { return t.node == node; });
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
    middle_.clear();
    operators_.clear();
    for (const Contact& contact : contacts_) {
        LowRank range{.begin = static_cast<int>(terms_.size())};
        middle_.push_back(add_terms(contact.a, 1, surfaces));
        range.end = add_terms(contact.b, -1, surfaces);
        operators_.push_back(range);
    }
    contact_terms_ = terms_.size();
    push_.resize(contacts_.size());
    linearise(v);
}

Eigen::Vector3d ContactSolver::velocity(int begin, int end, const Eigen::VectorXd& v) const {
    Eigen::Vector3d u = Eigen::Vector3d::Zero();
    for (const Term& t : terms(begin, end)) u += t.weight * v.segment<3>(t.unknown);
    return u;
}

/// out += sign J^T A J v.
void ContactSolver::add_product(const LowRank& matrix, double sign, const Eigen::VectorXd& v,
                                Eigen::VectorXd& out) const {
    if (matrix.A.isZero(0)) return;
    const Eigen::Vector3d impulse = sign * (matrix.A * velocity(matrix.begin, matrix.end, v));
    for (const Term& t : terms(matrix.begin, matrix.end))
        if (!t.held) out.segment<3>(t.unknown) += t.weight * impulse;
}

Eigen::VectorXd ContactSolver::impulses(const Eigen::VectorXd& v) const {
    Eigen::VectorXd out = Eigen::VectorXd::Zero(v.size());
    for (std::size_t c = 0; c < operators_.size(); ++c) {
        const LowRank& contact = operators_[c];
        if (contact.A.isZero(0)) continue;
        const Eigen::Vector3d p = push_[c] - contact.A * velocity(contact.begin, contact.end, v);
        for (const Term& t : terms(contact.begin, contact.end)) out.segment<3>(t.unknown) += t.weight * p;
    }
    return out;
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

/// Adds J^T A J of one body to its matrix where all its blocks fit the pattern, else a block-diagonal bound
/// from above, |w_i| sum |w| in place of w_i w_j, so that the matrix stays positive definite.
void ContactSolver::add_to_matrix(StepSystem& system, LowRank part) {
    if (part.begin == part.end) return;
    const std::vector<Term> side(terms_.begin() + part.begin, terms_.begin() + part.end);
    bool fits = true;
    double total = 0;
    for (const Term& s : side) {
        total += std::abs(s.weight);
        fits = fits &&
               std::ranges::all_of(side, [&](const Term& t) { return system.has_block(s.node, t.node); });
    }
    for (std::size_t i = 0; i < side.size(); ++i) {
        const double own = fits ? side[i].weight * side[i].weight : std::abs(side[i].weight) * total;
        system.add_block(side[i].node, side[i].node, own * part.A);
        for (std::size_t j = 0; fits && j < i; ++j)
            system.add_block(side[i].node, side[j].node, side[i].weight * side[j].weight * part.A);
        if (fits) continue;
        Term alone = side[i];
        alone.weight = std::sqrt(own);
        terms_.push_back(alone);
        const int end = static_cast<int>(terms_.size());
        in_matrix_.push_back({end - 1, end, part.A});
    }
    if (fits) in_matrix_.push_back(part);
}

void ContactSolver::order_bodies(std::span<StepSystem> systems) {
    order_.resize(systems.size());
    std::iota(order_.begin(), order_.end(), std::size_t{0});
    std::ranges::stable_sort(order_, {}, [&](std::size_t b) { return systems[b].body().material().young; });
    std::vector<std::size_t> rank(order_.size());
    for (std::size_t k = 0; k < order_.size(); ++k) rank[order_[k]] = k;
    coupled_.assign(systems.size(), {});
    for (std::size_t c = 0; c < contacts_.size(); ++c) {
        if (contacts_[c].b.body < 0) continue;
        const auto a = static_cast<std::size_t>(contacts_[c].a.body),
                   b = static_cast<std::size_t>(contacts_[c].b.body);
        coupled_[rank[a] < rank[b] ? a : b].push_back(c);
    }
}

void ContactSolver::add_to_matrices(std::span<StepSystem> systems) {
    expected_ = operators_;
    in_matrix_.clear();
    terms_.resize(contact_terms_);
    order_bodies(systems);
    for (std::size_t c = 0; c < contacts_.size(); ++c)
        if (contacts_[c].b.body < 0 && !operators_[c].A.isZero(0))
            add_to_matrix(systems[static_cast<std::size_t>(contacts_[c].a.body)], operators_[c]);
    for (std::size_t earlier = 0; earlier < systems.size(); ++earlier)
        for (const std::size_t c : coupled_[earlier]) {
            const LowRank& whole = operators_[c];
            if (whole.A.isZero(0)) continue;
            const bool is_a = static_cast<std::size_t>(contacts_[c].a.body) == earlier;
            add_to_matrix(systems[earlier],
                          {is_a ? whole.begin : middle_[c], is_a ? middle_[c] : whole.end, whole.A});
        }
}

void ContactSolver::mark_held(std::span<StepSystem> systems) {
    for (Term& t : terms_) t.held = systems[static_cast<std::size_t>(t.body)].is_prescribed(t.node);
}

/// out = the coupled operator times v.
void ContactSolver::multiply(std::span<StepSystem> systems, const Eigen::VectorXd& v,
                             Eigen::VectorXd& out) const {
    for (std::size_t b = 0; b < systems.size(); ++b) {
        const int first = first_unknown_[b], size = first_unknown_[b + 1] - first;
        systems[b].multiply(v.segment(first, size), out.segment(first, size));
    }
    for (const LowRank& contact : operators_) add_product(contact, 1, v, out);
    for (const LowRank& part : in_matrix_) add_product(part, -1, v, out);
}

/// out += the coupling of a body with the later ones times z: forward, on theirs from z of `earlier`; else,
/// on that of `earlier` from theirs.
void ContactSolver::couple(std::size_t earlier, bool forward, const Eigen::VectorXd& z,
                           Eigen::VectorXd& out) const {
    for (const std::size_t c : coupled_[earlier]) {
        const LowRank& contact = expected_[c];
        if (contact.A.isZero(0)) continue;
        const bool a_to_b = (static_cast<std::size_t>(contacts_[c].a.body) == earlier) == forward;
        const int from = a_to_b ? contact.begin : middle_[c], from_end = a_to_b ? middle_[c] : contact.end;
        const int to = a_to_b ? middle_[c] : contact.begin, to_end = a_to_b ? contact.end : middle_[c];
        const Eigen::Vector3d impulse = contact.A * velocity(from, from_end, z);
        for (const Term& t : terms(to, to_end))
            if (!t.held) out.segment<3>(t.unknown) += t.weight * impulse;
    }
}

void ContactSolver::solve_body(StepSystem& system, std::size_t body, Eigen::VectorXd& v) const {
    const int first = first_unknown_[body], size = first_unknown_[body + 1] - first;
    system.solve(v.segment(first, size), v.segment(first, size));
}

void ContactSolver::apply_preconditioner(std::span<StepSystem> systems, const Eigen::VectorXd& r,
                                         Eigen::VectorXd& z) {
    z = r;
    for (const std::size_t b : order_) {
        solve_body(systems[b], b, z);
        if (coupled_[b].empty()) continue;
        coupling_.setZero();
        couple(b, true, z, coupling_);
        z -= coupling_;
    }
    for (const std::size_t b : std::views::reverse(order_)) {
        if (coupled_[b].empty()) continue;
        coupling_.setZero();
        couple(b, false, z, coupling_);
        solve_body(systems[b], b, coupling_);
        z -= coupling_;
    }
}

bool ContactSolver::conjugate_gradients(std::span<StepSystem> systems, int most, Eigen::VectorXd& v,
                                        int& iterations) {
    multiply(systems, v, Ap_);
    r_ = rhs_ - Ap_;
    apply_preconditioner(systems, r_, z_);
    p_ = z_;
    double rz = r_.dot(z_);
    for (int k = 0; !(rz <= goal_); ++k) {
        if (k == most || !std::isfinite(rz)) return false;
        multiply(systems, p_, Ap_);
        const double step = rz / p_.dot(Ap_);
        v += step * p_;
        r_ -= step * Ap_;
        apply_preconditioner(systems, r_, z_);
        const double next = r_.dot(z_);
        p_ = z_ + (next / rz) * p_;
        rz = next;
        ++iterations;
    }
    return true;
}

void ContactSolver::set_rhs(std::span<StepSystem> systems) {
    for (std::size_t b = 0; b < systems.size(); ++b)
        rhs_.segment(first_unknown_[b], systems[b].rhs().size()) = systems[b].rhs();
    for (std::size_t c = 0; c < operators_.size(); ++c)
        for (const Term& t : terms(operators_[c].begin, operators_[c].end))
            if (!t.held) rhs_.segment<3>(t.unknown) += t.weight * push_[c];
}

std::vector<bool> ContactSolver::pressing() const {
    std::vector<bool> set;
    for (const LowRank& contact : operators_) set.push_back(!contact.A.isZero(0));
    return set;
}

ContactSolveReport ContactSolver::solve(std::span<StepSystem> systems, const std::function<void()>& rebuild,
                                        Eigen::VectorXd& v) {
    ContactSolveReport report;
    for (Eigen::VectorXd* scratch : {&rhs_, &r_, &z_, &p_, &Ap_, &coupling_}) scratch->resize(v.size());
    mark_held(systems);
    std::vector<bool> pressed = pressing();
    for (bool settled = false; !settled && report.passes < config_->iterations;) {
        const bool first = report.passes == 0;
        set_rhs(systems);
        if (first) {
            apply_preconditioner(systems, rhs_, v);
            goal_ = config_->tolerance * config_->tolerance * rhs_.dot(v);
        }
        bool solved = conjugate_gradients(systems, first ? most_iterations : stale_iterations, v,
                                          report.linear_iterations);
        if (!solved && !first) {
            rebuild();
            ++report.rebuilds;
            mark_held(systems);
            set_rhs(systems);
            solved = conjugate_gradients(systems, most_iterations, v, report.linear_iterations);
        }
        report.converged = report.converged && solved;
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
