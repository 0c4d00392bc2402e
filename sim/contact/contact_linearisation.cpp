// What the contacts of a ContactSolver do at some velocities, and the operators of the next solve.
#include <algorithm>

#include "sim/contact/contact_solver.hpp"

namespace nbd {
namespace {

constexpr double friction_share = 5e-4;    // of mu times the normal impulse, by which friction may be off
constexpr double most_change_of_slip = 3;  // from one pass to the next
/// Height over the floor at which a barrier is linearised at first, over that at which it becomes linear.
constexpr double first_height = 2.5;

}  // namespace

/// At the velocities before the step, the points of a contact may be behind its barrier: it is linearised
/// above.
void ContactSolver::set_first_operator(std::size_t contact, const Eigen::VectorXd& v) {
    const Contact& c = contacts_[contact];
    Eigen::Vector3d u = relative_velocity(contact, v);
    const double least = c.barrier.floor + first_height * (c.barrier.linear_below - c.barrier.floor);
    u += std::max(least - (c.gap + dt_ * c.normal.dot(u)), 0.0) / dt_ * c.normal;
    const ContactImpulse impulse = contact_impulse(c, dt_, u);
    if (!impulse.active()) {
        operators_[contact].A.setZero();
        push_[contact].setZero();
        return;
    }
    if (tangents_) return set_tangent(contact, impulse, slides_[contact].most, slides_[contact].slip);
    set_operator(contact, impulse,
                 c.friction * impulse.normal / std::max(c.slip(u, dt_).norm(), c.full_slip(dt_)));
}

void ContactSolver::linearise(const Eigen::VectorXd& v) {
    releases_.assign(contacts_.size(), 0);
    drags_.assign(contacts_.size(), {});
    drags_before_.assign(contacts_.size(), {});
    if (tangents_) slides_.assign(contacts_.size(), {});
    linearise(v, false, true);
}

/// What the contacts do at v. A solve balances the normal impulses between two bodies, those that pull among
/// them. Contacts that pull let go, and others begin to press in their place with impulses at v that nothing
/// balances, so where contacts pressed in the last solve, the friction between the two bodies is at most mu
/// times what was balanced, shared out like the impulses that push.
std::vector<ContactSolver::Rub> ContactSolver::rubs_at(const Eigen::VectorXd& v, bool solved) const {
    std::vector<Rub> rubs(contacts_.size());
    std::vector<double> pushing(pairs_.size(), 0.0), balanced(pairs_.size(), 0.0);  // N s
    std::vector<bool> pressed(pairs_.size(), false);
    for (std::size_t c = 0; c < contacts_.size(); ++c) {
        Rub& rub = rubs[c];
        rub.impulse = impulse(c, v);
        rub.slip = contacts_[c].slip(relative_velocity(c, v), dt_);
        pushing[pair_of_[c]] += rub.impulse.normal;
        if (!solved || !presses(c)) continue;
        pressed[pair_of_[c]] = true;
        balanced[pair_of_[c]] += contacts_[c].normal.dot(push_[c] - operators_[c].A * terms_.velocity(c, v));
    }
    for (std::size_t c = 0; c < contacts_.size(); ++c) {
        Rub& rub = rubs[c];
        if (!rub.impulse.active() || releases_[c] > 1) continue;
        rub.most = contacts_[c].friction * rub.impulse.normal;
        if (const std::size_t pair = pair_of_[c]; pressed[pair])
            rub.most *= std::clamp(balanced[pair] / pushing[pair], 0.0, 1.0);
    }
    return rubs;
}

/// By which the friction of the contact's drag is wrong, N s.
Eigen::Vector3d ContactSolver::friction_off(std::size_t contact, const Rub& rub) const {
    if (!rub.impulse.active() || !presses(contact)) return Eigen::Vector3d::Zero();
    const double most_drag = rub.most / std::max(rub.slip.norm(), contacts_[contact].full_slip(dt_));
    return (drags_[contact].drag - most_drag) * rub.slip;
}

/// Between which bodies friction is wrong by too large a share of that on one of them.
std::vector<bool> ContactSolver::wrong_pairs(const std::vector<Rub>& rubs) const {
    std::vector<double> most_of(first_unknown_.size(), 0.0);  // by body
    std::vector<Eigen::Vector3d> off_of(pairs_.size(), Eigen::Vector3d::Zero());
    std::vector<double> each_off_of(pairs_.size(), 0.0);
    for (std::size_t c = 0; c < contacts_.size(); ++c) {
        const std::size_t pair = pair_of_[c];
        const Eigen::Vector3d off = friction_off(c, rubs[c]);
        for (const int body : pairs_[pair])
            if (body >= 0) most_of[body] += rubs[c].most;
        off_of[pair] += contacts_[c].a.body == pairs_[pair][0] ? off : Eigen::Vector3d(-off);
        each_off_of[pair] += off.norm();
    }
    std::vector<bool> wrong(pairs_.size());
    for (std::size_t pair = 0; pair < pairs_.size(); ++pair) {
        const double off = each_contact_ ? each_off_of[pair] : off_of[pair].norm();
        wrong[pair] = std::ranges::any_of(
            pairs_[pair], [&](int body) { return body >= 0 && off > friction_share * most_of[body]; });
    }
    return wrong;
}

/// solved: operators are of a solve that found v or led to it. Contacts get the tangent of their barrier at
/// v; those that pressed in the solve keep their drag, unless `renews` and it and the friction between their
/// bodies are wrong. One that lets go for the second time presses without friction from then on,
/// because its drag may be what pulls it away: it would let go and press in turn.
void ContactSolver::linearise(const Eigen::VectorXd& v, bool solved, bool renews) {
    const std::vector<Rub> rubs = rubs_at(v, solved);
    const std::vector<bool> wrong = wrong_pairs(rubs);
    for (std::size_t c = 0; c < contacts_.size(); ++c) {
        const Rub& rub = rubs[c];
        const bool pressed = solved && presses(c);
        if (!rub.impulse.active()) {
            releases_[c] += pressed;
            operators_[c].A.setZero();
            push_[c].setZero();
            continue;
        }
        if (tangents_) {
            if (!pressed) slides_[c] = {.most = rub.most, .slip = rub.slip};
            set_tangent(c, rub.impulse, slides_[c].most, slides_[c].slip);
            continue;
        }
        const double slip = rub.slip.norm();
        drags_[c].slip = slip;
        if (pressed &&
            (!renews || !wrong[pair_of_[c]] || friction_off(c, rub).norm() <= friction_share * rub.most)) {
            set_operator(c, rub.impulse, drags_[c].drag);
            continue;
        }
        const double drag = next_drag(c, rub.most, slip);
        drags_before_[c] = drags_[c];
        set_operator(c, rub.impulse, drag);
    }
    linearise_bonds(v);
}

BondLaw::Terms ContactSolver::bond_terms(std::size_t bond, const Eigen::VectorXd& v) const {
    return bonds_[bond].law.at(bonds_[bond].difference + dt_ * terms_.velocity(contacts_.size() + bond, v));
}

void ContactSolver::linearise_bonds(const Eigen::VectorXd& v) {
    for (std::size_t k = 0; k < bonds_.size(); ++k) {
        const std::size_t index = contacts_.size() + k;
        const BondLaw::Terms terms = bond_terms(k, v);
        const Eigen::Matrix3d elastic = dt_ * dt_ * terms.hessian;
        operators_[index].A = elastic + dt_ * bonds_[k].velocity_factor * terms.drag;
        push_[index] = elastic * terms_.velocity(index, v) -
                       dt_ * (terms.gradient + bonds_[k].velocity_factor * terms.drag * bonds_[k].lead);
    }
}

Eigen::Vector3d ContactSolver::bond_impulse(std::size_t bond, const Eigen::VectorXd& v,
                                            std::span<const Eigen::Vector3d> of_each) const {
    const std::size_t index = contacts_.size() + bond;
    const Eigen::Vector3d impulse = linear_impulse(index, v);
    return of_each.empty() ? impulse : Eigen::Vector3d(impulse + of_each[index]);
}

Eigen::Vector3d ContactSolver::bond_place(std::size_t bond, const ImpulsePlaces& at) const {
    const std::size_t index = contacts_.size() + bond;
    return terms_.acts_at(index, place_of(index, at));
}

double ContactSolver::bond_potential(const Eigen::VectorXd& v) const {
    double sum = 0;
    for (std::size_t k = 0; k < bonds_.size(); ++k) {
        const BondLaw::Terms terms = bond_terms(k, v);
        const Eigen::Vector3d u = terms_.velocity(contacts_.size() + k, v) + bonds_[k].lead;
        sum += terms.energy + dt_ * bonds_[k].velocity_factor / 2 * u.dot(terms.drag * u);
    }
    return sum;
}

void ContactSolver::set_operator(std::size_t contact, const ContactImpulse& impulse, double drag) {
    const Eigen::Vector3d& n = contacts_[contact].normal;
    const Eigen::Matrix3d normal_part = n * n.transpose();
    Eigen::Matrix3d& A = operators_[contact].A;
    A = impulse.slope * normal_part + drag * (Eigen::Matrix3d::Identity() - normal_part);
    push_[contact] =
        impulse.push * n + A * contacts_[contact].wall_velocity - drag / dt_ * contacts_[contact].stretch;
    drags_[contact].drag = drag;
}

/// Friction of at most `most` at a slip and about it: how it turns with the slip, and no change of its size
/// where the contact slides.
void ContactSolver::set_tangent(std::size_t contact, const ContactImpulse& impulse, double most,
                                const Eigen::Vector3d& slip) {
    const Contact& c = contacts_[contact];
    const double speed = slip.norm();
    const double drag = most / std::max(speed, c.full_slip(dt_));
    set_operator(contact, impulse, drag);
    if (speed <= c.full_slip(dt_)) return;
    const Eigen::Vector3d along = slip / speed;
    const Eigen::Matrix3d less = drag * along * along.transpose();
    operators_[contact].A -= less;
    push_[contact] += less * (c.stretch / dt_ - c.wall_velocity) - most * along;
}

/// The drag for a friction of `most`. Where nothing else changes, 1 / slip is linear in the drag: the last
/// two solves tell at which slip the two balance. Only repeating most / slip would take many passes where
/// friction nearly stops the contact.
double ContactSolver::next_drag(std::size_t contact, double most, double slip) const {
    const Drag &now = drags_[contact], &before = drags_before_[contact];
    double balanced = slip;
    if (now.slip > 0 && before.slip > 0 && now.drag != before.drag) {
        const double slope = (1 / now.slip - 1 / before.slip) / (now.drag - before.drag),
                     free = 1 / now.slip - slope * now.drag;
        if (slope > 0 && free > 0) balanced = (1 - most * slope) / free;
    }
    // Where neighbours change, too, the two solves say less.
    balanced = std::clamp(balanced, slip / most_change_of_slip, slip * most_change_of_slip);
    return most / std::max(balanced, contacts_[contact].full_slip(dt_));
}

}  // namespace nbd
