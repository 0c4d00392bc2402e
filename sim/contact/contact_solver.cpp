#include "sim/contact/contact_solver.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "collision/base/stop.hpp"
#include "sim/contact/pair_rules.hpp"

namespace nbd {
namespace {

constexpr double first_share = 0.1;  // share of the step's impulses left by the first pass
constexpr double pass_share = 0.01;  // share of the residual left by a pass before contacts are updated
constexpr int friction_passes = 8;   // after so many accurate ones, drags stay
constexpr int settling_passes = 4;   // drags stay in the last ones
constexpr double passed_by = 0.1;    // slope of the potential at the end of a pass, of that at its beginning

}  // namespace

void ContactSolver::begin(std::span<const Contact> contacts, std::span<const Bond> bonds,
                          std::span<const ContactShape* const> shapes, std::span<const int> first_unknown,
                          double tolerance, std::span<const TimeStep> steps, const Eigen::VectorXd& v,
                          bool each_contact, bool tangents) {
    shapes_ = shapes;
    first_unknown_ = first_unknown;
    settled_share_ = tolerance;
    tolerance_ = linear_tolerance_;
    each_contact_ = each_contact;
    tangents_ = tangents;
    steps_ = steps;
    dt_ = steps.empty() ? 0 : steps.front().dt;
    start_ = v;
    step_impulses_.clear();
    set_contacts(contacts, bonds, v);
}

void ContactSolver::solve_to(double share) noexcept {
    settled_share_ *= share;
    tolerance_ = share * linear_tolerance_;
}

void ContactSolver::set_contacts(std::span<const Contact> contacts, std::span<const Bond> bonds,
                                 const Eigen::VectorXd& v) {
    contacts_ = contacts;
    bonds_ = bonds;
    terms_.clear();
    operators_.clear();
    for (const Contact& contact : contacts_) terms_.add(contact, shapes_, first_unknown_);
    for (const Bond& bond : bonds_) terms_.add(bond, first_unknown_);
    for (std::size_t c = 0; c < contacts_.size() + bonds_.size(); ++c)
        operators_.push_back(terms_.coupling(c, Eigen::Matrix3d::Zero()));
    number_pairs();
    push_.resize(operators_.size());
    linearise(v);
    for (std::size_t c = 0; c < contacts_.size(); ++c) set_first_operator(c, v);
}

/// Numbers the pairs of bodies in contact or bonds; all obstacles count as one, with the world.
void ContactSolver::number_pairs() {
    std::map<std::array<int, 2>, std::size_t> numbers;
    pairs_.clear();
    pair_of_.clear();
    for (std::size_t c = 0; c < operators_.size(); ++c) {
        const auto [least, most] = std::minmax(terms_.bodies(c)[0], terms_.bodies(c)[1]);
        const auto [known, is_new] = numbers.try_emplace({most, least}, pairs_.size());
        if (is_new) pairs_.push_back(known->first);
        pair_of_.push_back(known->second);
    }
}

/// Relative velocity of the contact's points, minus the wall's velocity.
Eigen::Vector3d ContactSolver::relative_velocity(std::size_t contact, const Eigen::VectorXd& v) const {
    return terms_.velocity(contact, v) - contacts_[contact].wall_velocity;
}

std::vector<char> ContactSolver::pressed_bodies() const {
    std::vector<char> pressed(shapes_.size(), 0);
    for (std::size_t c = 0; c < contacts_.size(); ++c)
        for (const int body : terms_.bodies(c))
            if (presses(c) && body >= 0 && terms_.bodies(c)[0] != terms_.bodies(c)[1]) pressed[body] = 1;
    return pressed;
}

std::vector<RubbedContact> ContactSolver::rubbed(const Eigen::VectorXd& v) const {
    std::vector<RubbedContact> rubbed;
    for (std::size_t c = 0; c < contacts_.size(); ++c) {
        if (!presses(c)) continue;
        rubbed.push_back(
            {contacts_[c], dt_ * contacts_[c].along(relative_velocity(c, v)), impulse(c, v).normal});
    }
    return rubbed;
}

ContactImpulse ContactSolver::impulse(std::size_t contact, const Eigen::VectorXd& v) const {
    return contact_impulse(contacts_[contact], dt_, relative_velocity(contact, v));
}

double ContactSolver::friction_potential(const Eigen::VectorXd& v, const Eigen::VectorXd& friction_at) const {
    double sum = 0;
    for (std::size_t c = 0; c < contacts_.size(); ++c)
        sum += nbd::friction_potential(contacts_[c], dt_, impulse(c, friction_at).normal,
                                       relative_velocity(c, v));
    return sum;
}

Eigen::VectorXd ContactSolver::normal_impulses(const Eigen::VectorXd& v) const {
    Eigen::VectorXd out = Eigen::VectorXd::Zero(v.size());
    for (std::size_t c = 0; c < contacts_.size(); ++c)
        terms_.add_impulse(c, impulse(c, v).normal * contacts_[c].normal, false, out);
    return out;
}

Eigen::VectorXd ContactSolver::impulses(const Eigen::VectorXd& v) const { return impulses(v, true); }

Eigen::VectorXd ContactSolver::step_impulses(const Eigen::VectorXd& v) const {
    return impulses(v, true, true);
}

Eigen::VectorXd ContactSolver::contact_impulses(const Eigen::VectorXd& v,
                                                std::span<const Eigen::Vector3d> of_each) const {
    Eigen::VectorXd out = Eigen::VectorXd::Zero(v.size());
    for (std::size_t c = 0; c < contacts_.size(); ++c) {
        Eigen::Vector3d impulse = presses(c) ? linear_impulse(c, v) : Eigen::Vector3d::Zero();
        if (!of_each.empty()) impulse += of_each[c];
        terms_.add_impulse(c, impulse, true, out);
    }
    return out;
}

/// held: whether those on nodes with prescribed velocities count. of_step_alone: see step_impulses().
Eigen::VectorXd ContactSolver::impulses(const Eigen::VectorXd& v, bool held, bool of_step_alone) const {
    Eigen::VectorXd out = Eigen::VectorXd::Zero(v.size());
    for (std::size_t c = 0; c < operators_.size(); ++c) {
        if (!presses(c) || (of_step_alone && !acts_in_step_alone(c))) continue;
        terms_.add_impulse(c, linear_impulse(c, v), held, out);
    }
    return out;
}

/// Which of the places a contact or bond acts at.
const BodyPositions& ContactSolver::place_of(std::size_t index, const ImpulsePlaces& at) const {
    if (index >= contacts_.size()) {
        const Bond::Time time = bonds_[index - contacts_.size()].acts_at;
        return time == Bond::Time::start ? at.starts : time == Bond::Time::middle ? at.middles : at.ends;
    }
    const auto [a, b] = terms_.bodies(index);
    const bool is_mixed = a >= 0 && b >= 0 && steps_[a].velocity_factor != steps_[b].velocity_factor;
    return is_mixed ? at.starts : at.middles;
}

std::vector<Momentum> ContactSolver::momenta(const Eigen::VectorXd& v, const ImpulsePlaces& at) const {
    std::vector<Momentum> momenta(at.middles.x.size());
    for (std::size_t c = 0; c < operators_.size(); ++c) {
        if (!presses(c)) continue;
        terms_.add_momentum(c, linear_impulse(c, v), place_of(c, at), momenta);
    }
    return momenta;
}

std::vector<PairImpulse> ContactSolver::pair_impulses(const Eigen::VectorXd& v,
                                                      std::span<const Eigen::Vector3d> of_each,
                                                      const ImpulsePlaces& at) const {
    std::map<std::pair<int, int>, PairImpulse> sums;
    for (std::size_t c = 0; c < contacts_.size(); ++c) {
        const Contact& contact = contacts_[c];
        const int a = contact.a.body,
                  b = contact.b.body < 0 ? party_of_obstacle(contact.obstacle) : contact.b.body;
        if (!presses(c) || a == b) continue;
        Eigen::Vector3d impulse = linear_impulse(c, v);
        if (!of_each.empty()) impulse += of_each[c];
        const bool is_on_a = b < 0 || a < b;
        if (!is_on_a) impulse *= -1;
        PairImpulse& sum = sums[is_on_a ? std::pair(a, b) : std::pair(b, a)];
        sum.linear += impulse;
        const Eigen::Vector3d place = terms_.acts_at(c, place_of(c, at));
        sum.angular += place.cross(impulse);
        sum.place.add(place, impulse.norm());
    }
    std::vector<PairImpulse> all;
    for (auto& [pair, sum] : sums) {
        std::tie(sum.body, sum.other) = pair;
        all.push_back(sum);
    }
    return all;
}

void ContactSolver::set_rhs(std::span<const StepSystem> systems) {
    rhs_.resize(first_unknown_.back());
    for (std::size_t b = 0; b < systems.size(); ++b)
        rhs_.segment(first_unknown_[b], systems[b].rhs().size()) = systems[b].rhs();
    for (std::size_t c = 0; c < operators_.size(); ++c) terms_.add_impulse(c, push_[c], false, rhs_);
}

/// Takes the sizes of impulses in the step, but for contacts. What barriers would do at the
/// velocities before the step is no measure: it can be many times what they do. v: the guess of the
/// velocities after it.
void ContactSolver::measure_step(std::span<const StepSystem> systems, const Eigen::VectorXd& v) {
    Eigen::VectorXd change = v - start_;
    for (std::size_t b = 0; b < systems.size(); ++b)
        for (int i = 0; i < systems[b].body().node_count(); ++i)
            change.segment<3>(first_unknown_[b] + 3 * i) *= systems[b].body().node_masses()[i];
    step_impulses_ = yielding_impulses_ = linear_.norms().of(change);
    for (std::size_t b = 0; b < systems.size(); ++b) {
        step_impulses_[b] = std::hypot(step_impulses_[b], systems[b].impulse_norm());
        yielding_impulses_[b] =
            std::hypot(yielding_impulses_[b],
                       operators_.empty() ? systems[b].impulse_norm() : systems[b].yielding_norm());
    }
}

/// Adds the impulses of contacts at v to the sizes.
void ContactSolver::measure_contacts(std::span<const StepSystem> systems, const Eigen::VectorXd& v) {
    Eigen::VectorXd pushes = impulses(v), stiffness = Eigen::VectorXd::Zero(v.size() / 3);
    const std::vector<double> sizes = linear_.norms().of(pushes);
    for (std::size_t c = 0; c < operators_.size(); ++c)
        for (const CouplingTerm& t : terms_.of(c))
            stiffness[t.unknown / 3] += t.weight * t.weight * operators_[c].A.trace() / 3;
    for (std::size_t b = 0; b < systems.size(); ++b)
        for (int i = 0; i < systems[b].body().node_count(); ++i) {
            const int node = first_unknown_[b] / 3 + i;
            pushes.segment<3>(3 * node) *= systems[b].softness(i, stiffness[node]);
        }
    const std::vector<double> yielding = linear_.norms().of(pushes);
    for (std::size_t b = 0; b < sizes.size(); ++b) {
        scales_[b] = std::hypot(step_impulses_[b], sizes[b]);
        yielding_scales_[b] = std::hypot(yielding_impulses_[b], yielding[b]);
    }
}

double ContactSolver::share_of_scales(const Eigen::VectorXd& r, const Eigen::VectorXd& rounding) const {
    std::vector<double> norms = linear_.norms().of(r);
    const std::vector<double> least = linear_.norms().of(rounding);
    for (std::size_t b = 0; b < norms.size(); ++b)
        if (norms[b] <= least[b]) norms[b] = 0;
    return worst_share(norms, scales_);
}

ContactSolveReport ContactSolver::solve(std::span<const StepSystem> systems, Eigen::VectorXd& v) {
    ContactSolveReport report;
    terms_.hold(systems);
    const CoupledSystem system{systems, first_unknown_, terms_.all(), operators_};
    linear_.begin_matrices(system);
    set_rhs(systems);
    product_.resize(v.size());
    if (step_impulses_.empty()) measure_step(systems, v);
    scales_ = step_impulses_;
    yielding_scales_ = yielding_impulses_;
    std::vector<double> goals(yielding_scales_);
    for (double& goal : goals) goal *= operators_.empty() ? tolerance_ : std::max(tolerance_, first_share);
    report.settled = operators_.empty();
    bool is_measured = true;  // whether left_ is, rather than carried on from pass to pass
    int renewed = 0;          // accurate passes after which drags were set anew
    bool went_back = false;   // whether v is not where the last pass led
    Eigen::VectorXd begin;
    for (; report.passes < most_passes; ++report.passes) {
        stop_if_asked();
        begin = v;
        const LinearSolveReport solved = is_measured ? linear_.solve(system, rhs_, goals, v)
                                                     : linear_.solve_roughly(system, rhs_, change_, goals, v);
        report.linear_iterations += solved.iterations;
        report.converged = report.converged && solved.converged;
        if (!solved.fallback.empty()) report.fallback = solved.fallback;
        if (operators_.empty()) break;
        const bool is_accurate =
            worst_share(linear_.norms().of(linear_.residual()), yielding_scales_) <= pass_share;
        change_.setZero(v.size());
        // After the last pass nothing would balance what lies between.
        went_back = report.passes > 0 && report.passes + 1 < most_passes && go_back(begin, v);
        measure_contacts(systems, v);
        solved_by_ = operators_;
        solved_push_ = push_;
        change_ -= impulses(v, false);
        const bool renews = renewed < friction_passes && report.passes < most_passes - settling_passes;
        renewed += renews && is_accurate && !went_back;
        linearise(v, true, renews);
        change_ += impulses(v, false);
        set_rhs(systems);
        left_ = linear_.residual() + change_;
        is_measured = false;
        report.settled = set_goals(goals);
        if (!report.settled) continue;
        system.multiply(v, product_);
        left_ = rhs_ - product_;
        is_measured = true;
        report.settled = set_goals(goals);
        if (report.settled) break;
    }
    // The impulses that were solved for balance the motion; those of the update need not, unless the last
    // pass went back to where they do.
    if (!operators_.empty() && !(report.settled && went_back)) {
        operators_ = solved_by_;
        push_ = solved_push_;
    }
    for (std::size_t c = 0; c < contacts_.size(); ++c) report.active += presses(c);
    return report;
}

/// Moves v, which a pass found from `begin`, back to where the potential of the step is least between the
/// two, and sets change_ to how that changes the residual. Returns whether v moved. Contacts that a pass does
/// not know and that press at its end shorten the way: without it, the passes of stiff bodies can let two
/// sets of contacts press in turn. The friction of a pass counts as its drags say.
bool ContactSolver::go_back(const Eigen::VectorXd& begin, Eigen::VectorXd& v) {
    /// Where a contact does not do what its operator says: it presses harder, or the operator pulls.
    struct Flip {
        std::size_t contact;
        Eigen::Vector3d u, way;          // relative velocity at the begin, and its change, m/s
        double operator_begin, closing;  // normal impulse of the operator at the begin, N s; m/s
        double operator_change;          // of that impulse
    };
    const Eigen::VectorXd way = v - begin;
    std::vector<Flip> flips;
    const auto lacks = [&](const Flip& flip, double share) {  // N s, of the operator
        const Eigen::Vector3d u = flip.u + share * flip.way;
        return contact_impulse(contacts_[flip.contact], dt_, u).normal -
               (flip.operator_begin + share * flip.operator_change);
    };
    for (std::size_t c = 0; c < contacts_.size(); ++c) {
        const Eigen::Vector3d& n = contacts_[c].normal;
        const Eigen::Vector3d w = terms_.velocity(c, begin), dw = terms_.velocity(c, way);
        const Flip flip{.contact = c,
                        .u = w - contacts_[c].wall_velocity,
                        .way = dw,
                        .operator_begin = n.dot(push_[c] - operators_[c].A * w),
                        .closing = -n.dot(dw),
                        .operator_change = -n.dot(operators_[c].A * dw)};
        if (lacks(flip, 1) > 0 || lacks(flip, 0) > 0) flips.push_back(flip);
    }
    const double first = left_.dot(way), last = linear_.residual().dot(way);
    const auto descent = [&](double share) {
        double sum = (1 - share) * first + share * last;
        for (const Flip& flip : flips) sum -= lacks(flip, share) * flip.closing;
        return sum;
    };
    if (first <= 0 || descent(0) <= 0 || descent(1) >= -passed_by * first) return false;
    double least = 0, most = 1;
    for (int i = 0; i < 30; ++i) {
        const double middle = (least + most) / 2;
        (descent(middle) > 0 ? least : most) = middle;
    }
    v = begin + most * way;
    change_ = (1 - most) * (left_ - linear_.residual());
    return true;
}

/// The goals of the next pass. Returns whether none is needed, by the residual left_.
bool ContactSolver::set_goals(std::vector<double>& goals) const {
    const std::vector<double> left = linear_.norms().of(left_);
    bool is_settled = true;
    for (std::size_t b = 0; b < left.size(); ++b) {
        const double most = std::max(settled_share_ * yielding_scales_[b], 2 * linear_.rounding()[b]);
        is_settled = is_settled && left[b] <= most;
        goals[b] = std::max(tolerance_ * yielding_scales_[b], pass_share * left[b]);
    }
    return is_settled;
}

}  // namespace nbd
