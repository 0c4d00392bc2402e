#include "sim/contact_solver.hpp"

#include <algorithm>
#include <cmath>

namespace nbd {
namespace {

constexpr double tolerance = 1e-6;  // of conjugate gradients, relative, in the preconditioner's norm
constexpr int most_iterations = 300;

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
                terms_.push_back({point.body, node, first_unknown_[body] + 3 * node, weight});
        }
    }
    return static_cast<int>(terms_.size());
}

void ContactSolver::begin(std::span<const Contact> contacts, std::span<const ContactSurface* const> surfaces,
                          std::span<const int> first_unknown) {
    contacts_ = contacts;
    first_unknown_ = first_unknown;
    terms_.clear();
    middle_.clear();
    operators_.clear();
    in_matrix_.clear();
    for (const Contact& contact : contacts_) {
        LowRank range{.begin = static_cast<int>(terms_.size())};
        middle_.push_back(add_terms(contact.a, 1, surfaces));
        range.end = add_terms(contact.b, -1, surfaces);
        operators_.push_back(range);
    }
    push_.assign(contacts_.size(), Eigen::Vector3d::Zero());
}

Eigen::Vector3d ContactSolver::velocity(int begin, int end, const Eigen::VectorXd& v) const {
    Eigen::Vector3d u = Eigen::Vector3d::Zero();
    for (const Term& t : terms(begin, end)) u += t.weight * v.segment<3>(t.unknown);
    return u;
}

/// out += sign J^T A J v.
void ContactSolver::add_product(const LowRank& matrix, double sign, const Eigen::VectorXd& v,
                                Eigen::VectorXd& out) const {
    const Eigen::Vector3d impulse = sign * (matrix.A * velocity(matrix.begin, matrix.end, v));
    for (const Term& t : terms(matrix.begin, matrix.end)) out.segment<3>(t.unknown) += t.weight * impulse;
}

void ContactSolver::linearise(const ContactConfig& config, double thickness, double dt,
                              const Eigen::VectorXd& v) {
    for (std::size_t c = 0; c < contacts_.size(); ++c) {
        const Eigen::Vector3d u =
            velocity(operators_[c].begin, operators_[c].end, v) - contacts_[c].wall_velocity;
        const ContactImpulse impulse = contact_impulse(contacts_[c], config, thickness, dt, u);
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

void ContactSolver::precondition(std::span<StepSystem> systems, const ContactConfig& config, double thickness,
                                 double dt, const Eigen::VectorXd& v) {
    linearise(config, thickness, dt, v);
    for (std::size_t c = 0; c < contacts_.size(); ++c) {
        const LowRank& whole = operators_[c];
        if (whole.A.isZero(0)) continue;
        const Contact& contact = contacts_[c];
        add_to_matrix(systems[static_cast<std::size_t>(contact.a.body)], {whole.begin, middle_[c], whole.A});
        if (contact.b.body >= 0)
            add_to_matrix(systems[static_cast<std::size_t>(contact.b.body)],
                          {middle_[c], whole.end, whole.A});
    }
}

/// out = the coupled operator times v; rows of prescribed nodes are zero.
void ContactSolver::multiply(std::span<StepSystem> systems, const Eigen::VectorXd& v,
                             Eigen::VectorXd& out) const {
    for (std::size_t b = 0; b < systems.size(); ++b) {
        const int first = first_unknown_[b], size = first_unknown_[b + 1] - first;
        systems[b].multiply(v.segment(first, size), out.segment(first, size));
    }
    for (const LowRank& contact : operators_) add_product(contact, 1, v, out);
    for (const LowRank& part : in_matrix_) add_product(part, -1, v, out);
    clear_prescribed(systems, out);
}

void ContactSolver::clear_prescribed(std::span<StepSystem> systems, Eigen::VectorXd& v) const {
    for (std::size_t b = 0; b < systems.size(); ++b)
        for (int i = 0; i < systems[b].body().node_count(); ++i)
            if (systems[b].is_prescribed(i)) v.segment<3>(first_unknown_[b] + 3 * i).setZero();
}

void ContactSolver::apply_factors(std::span<StepSystem> systems, const Eigen::VectorXd& r,
                                  Eigen::VectorXd& z) const {
    for (std::size_t b = 0; b < systems.size(); ++b) {
        const int first = first_unknown_[b], size = first_unknown_[b + 1] - first;
        systems[b].solve(r.segment(first, size), z.segment(first, size));
    }
}

/// goal: squared norm of the residual to reach, in the preconditioner's norm.
bool ContactSolver::conjugate_gradients(std::span<StepSystem> systems, double goal, Eigen::VectorXd& v,
                                        int& iterations) {
    multiply(systems, v, Ap_);
    r_ = rhs_ - Ap_;
    clear_prescribed(systems, r_);
    apply_factors(systems, r_, z_);
    p_ = z_;
    double rz = r_.dot(z_);
    for (int k = 0; !(rz <= goal); ++k) {
        if (k == most_iterations || !std::isfinite(rz)) return false;
        multiply(systems, p_, Ap_);
        const double step = rz / p_.dot(Ap_);
        v += step * p_;
        r_ -= step * Ap_;
        apply_factors(systems, r_, z_);
        const double next = r_.dot(z_);
        p_ = z_ + (next / rz) * p_;
        rz = next;
        ++iterations;
    }
    return true;
}

void ContactSolver::set_rhs(std::span<StepSystem> systems) {
    rhs_.setZero();
    for (std::size_t c = 0; c < operators_.size(); ++c)
        for (const Term& t : terms(operators_[c].begin, operators_[c].end))
            rhs_.segment<3>(t.unknown) += t.weight * push_[c];
    clear_prescribed(systems, rhs_);
    for (std::size_t b = 0; b < systems.size(); ++b)
        rhs_.segment(first_unknown_[b], systems[b].rhs().size()) += systems[b].rhs();
}

std::vector<bool> ContactSolver::pressing() const {
    std::vector<bool> set;
    for (const LowRank& contact : operators_) set.push_back(!contact.A.isZero(0));
    return set;
}

ContactSolveReport ContactSolver::solve(std::span<StepSystem> systems, const ContactConfig& config,
                                        double thickness, double dt, Eigen::VectorXd& v) {
    ContactSolveReport report;
    for (Eigen::VectorXd* scratch : {&rhs_, &r_, &z_, &p_, &Ap_}) scratch->resize(v.size());
    double goal = 0;
    std::vector<bool> pressed = pressing();
    for (bool settled = false; !settled && report.passes < config.iterations;) {
        set_rhs(systems);
        if (report.passes == 0) {
            apply_factors(systems, rhs_, v);
            goal = tolerance * tolerance * rhs_.dot(v);
        }
        if (!conjugate_gradients(systems, goal, v, report.linear_iterations)) report.converged = false;
        ++report.passes;
        linearise(config, thickness, dt, v);
        std::vector<bool> pressing_now = pressing();
        // Friction is first guessed from the velocities before the step, so one repetition is due in any
        // case.
        settled = contacts_.empty() || (report.passes > 1 && pressing_now == pressed);
        pressed.swap(pressing_now);
    }
    report.active = static_cast<int>(std::ranges::count(pressed, true));
    return report;
}

}  // namespace nbd
