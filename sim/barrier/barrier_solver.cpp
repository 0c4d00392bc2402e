#include "sim/barrier/barrier_solver.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace nbd {
namespace {

/// Share of each body's residual of a linearisation that its linear solve may leave. Smaller ones cost more,
/// and Newton takes as many iterations.
constexpr double residual_share = 0.1;

/// The size of friction does not grow with the speed of sliding. Near the solution this share of that growth
/// is taken out of its linearisation.
constexpr double slip_share = 0.9;

}  // namespace

void BarrierSolver::begin_step(std::vector<const ContactSurface*> surfaces,
                               std::span<const int> first_unknown, double dt) {
    surfaces_ = std::move(surfaces);
    first_unknown_ = first_unknown;
    dt_ = dt;
}

void BarrierSolver::set_contacts(std::vector<BarrierContact> contacts,
                                 std::vector<FrictionContact> friction) {
    friction_ = std::move(friction);
    friction_terms_.clear();
    for (const FrictionContact& f : friction_) friction_terms_.add(f.contact, surfaces_, first_unknown_);
    set_contacts(std::move(contacts));
}

void BarrierSolver::set_contacts(std::vector<BarrierContact> contacts) {
    contacts_ = std::move(contacts);
    terms_.clear();
    for (const BarrierContact& c : contacts_) terms_.add(c.contact, surfaces_, first_unknown_);
    for (const FrictionContact& f : friction_) terms_.add(f.contact, surfaces_, first_unknown_);
}

/// Of a friction contact, minus the wall's velocity.
Eigen::Vector3d BarrierSolver::relative_velocity(std::size_t friction, const Eigen::VectorXd& v) const {
    return friction_terms_.velocity(friction, v) - friction_[friction].contact.wall_velocity;
}

Eigen::Vector3d BarrierSolver::slip(std::size_t friction, const Eigen::VectorXd& v) const {
    return friction_[friction].contact.slip(relative_velocity(friction, v), dt_);
}

/// Impulse over slip, kg.
double BarrierSolver::drag(std::size_t friction, double slip) const {
    const FrictionContact& f = friction_[friction];
    return f.contact.friction * f.normal_impulse / std::max(slip, f.contact.full_slip(dt_));
}

std::vector<RubbedContact> BarrierSolver::rubbed(const Eigen::VectorXd& v) const {
    std::vector<RubbedContact> rubbed;
    for (std::size_t f = 0; f < friction_.size(); ++f) {
        const Contact& contact = friction_[f].contact;
        rubbed.push_back(
            {contact, dt_ * contact.along(relative_velocity(f, v)), friction_[f].normal_impulse});
    }
    return rubbed;
}

double BarrierSolver::friction_potential(const Eigen::VectorXd& v) const {
    double sum = 0;
    for (std::size_t f = 0; f < friction_.size(); ++f) {
        const double speed = slip(f, v).norm(), edge = friction_[f].contact.full_slip(dt_);
        const double length = speed < edge ? speed * speed / (2 * edge) : speed - edge / 2;
        sum += friction_[f].contact.friction * friction_[f].normal_impulse * length;
    }
    return sum;
}

Eigen::VectorXd BarrierSolver::impulses(const Eigen::VectorXd& v) const {
    Eigen::VectorXd out = Eigen::VectorXd::Zero(v.size());
    for (std::size_t c = 0; c < contacts_.size(); ++c)
        terms_.add_impulse(c, -dt_ * contacts_[c].slope * contacts_[c].contact.normal, true, out);
    for (std::size_t f = 0; f < friction_.size(); ++f) {
        const Eigen::Vector3d u = slip(f, v);
        friction_terms_.add_impulse(f, -drag(f, u.norm()) * u, true, out);
    }
    return out;
}

std::vector<Momentum> BarrierSolver::momenta(const Eigen::VectorXd& v, const BodyPositions& at) const {
    std::vector<Momentum> momenta(at.x.size());
    for (std::size_t c = 0; c < contacts_.size(); ++c) {
        const Contact& contact = contacts_[c].contact;
        const Eigen::Vector3d p = -dt_ * contacts_[c].slope * contact.normal;
        if (!contacts_[c].turns) {
            terms_.add_momentum(contact, c, p, at, momenta);
            continue;
        }
        // A couple on an edge, which balances that on the other edge where both are at the end.
        Eigen::Vector3d edge = dt_ * terms_.velocity(c, v);
        for (const CouplingTerm& t : terms_.of(c)) edge += t.weight * at.x[t.body].row(t.node).transpose();
        momenta[contact.a.body].angular += edge.cross(p);
    }
    for (std::size_t f = 0; f < friction_.size(); ++f) {
        const Eigen::Vector3d u = slip(f, v);
        friction_terms_.add_momentum(friction_[f].contact, f, -drag(f, u.norm()) * u, at, momenta);
    }
    return momenta;
}

void BarrierSolver::linearise(std::span<const StepSystem> systems, double wall_left, bool is_near,
                              Eigen::VectorXd& v) {
    systems_ = systems;
    terms_.hold(systems);
    couplings_.clear();
    rhs_.resize(first_unknown_.back());
    for (std::size_t b = 0; b < systems.size(); ++b) {
        rhs_.segment(first_unknown_[b], systems[b].rhs().size()) = systems[b].rhs();
        for (int i = 0; i < systems[b].body().node_count(); ++i)
            if (systems[b].is_prescribed(i))
                v.segment<3>(first_unknown_[b] + 3 * i) = systems[b].rhs().segment<3>(3 * i);
    }
    for (std::size_t c = 0; c < contacts_.size(); ++c) {
        const BarrierContact& barrier = contacts_[c];
        const Eigen::Vector3d& n = barrier.contact.normal;
        const Eigen::Matrix3d A = dt_ * dt_ * barrier.curvature * n * n.transpose();
        couplings_.push_back(terms_.coupling(c, A));
        const Eigen::Vector3d reached = terms_.velocity(c, v) + wall_left * barrier.contact.wall_velocity;
        terms_.add_impulse(c, A * reached - dt_ * barrier.slope * n, false, rhs_);
    }
    const double out = is_near ? slip_share : 0;
    for (std::size_t f = 0; f < friction_.size(); ++f) {
        const std::size_t place = contacts_.size() + f;
        const Eigen::Vector3d &n = friction_[f].contact.normal, u = slip(f, v);
        const double speed = u.norm(), size = drag(f, speed);
        Eigen::Matrix3d A = size * (Eigen::Matrix3d::Identity() - n * n.transpose());
        if (speed > friction_[f].contact.full_slip(dt_))
            A -= out * size / (speed * speed) * u * u.transpose();
        couplings_.push_back(terms_.coupling(place, A));
        terms_.add_impulse(place, A * terms_.velocity(place, v) - size * u, false, rhs_);
    }
    residual_.resize(v.size());
    system().multiply(v, residual_);
    residual_ = rhs_ - residual_;
}

CoupledSystem BarrierSolver::system() const { return {systems_, first_unknown_, terms_.all(), couplings_}; }

LinearSolveReport BarrierSolver::solve(Eigen::VectorXd& v) {
    linear_.begin_matrices(system());
    std::vector<double> goals = linear_.norms().of(residual_);
    for (double& goal : goals) goal *= residual_share;
    return linear_.solve(system(), rhs_, goals, v);
}

Eigen::VectorXd BarrierSolver::rounding() const {
    const double moved = std::numeric_limits<double>::epsilon() / dt_;
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(first_unknown_.back() / 3);
    for (std::size_t b = 0; b < systems_.size(); ++b) {
        const std::vector<Eigen::Matrix3d>& diagonal = systems_[b].matrix().diagonal();
        for (std::size_t i = 0; i < diagonal.size(); ++i)
            if (!systems_[b].is_prescribed(i))
                sum[first_unknown_[b] / 3 + static_cast<Eigen::Index>(i)] = moved * diagonal[i].trace();
    }
    const CoupledSystem whole = system();
    for (const Coupling& coupling : couplings_)
        for (const CouplingTerm& t : whole.terms_of(coupling))
            if (!t.held) sum[t.unknown / 3] += moved * std::abs(t.weight) * coupling.A.trace();
    return sum;
}

std::vector<int> BarrierSolver::clusters() const {
    std::vector<int> parent(first_unknown_.size() - 1);
    std::iota(parent.begin(), parent.end(), 0);
    std::vector<char> meets_obstacle(parent.size(), 0);
    const auto root = [&](int body) {
        while (parent[body] != body) body = parent[body];
        return body;
    };
    const auto join = [&](const Contact& contact) {
        const int a = root(contact.a.body);
        if (contact.b.body < 0) {
            meets_obstacle[contact.a.body] = 1;
            return;
        }
        const int b = root(contact.b.body);
        parent[std::max(a, b)] = std::min(a, b);
    };
    for (const BarrierContact& c : contacts_)
        if (!c.turns) join(c.contact);
    for (const FrictionContact& f : friction_) join(f.contact);
    std::vector<int> cluster(parent.size());
    for (std::size_t b = 0; b < parent.size(); ++b) {
        cluster[b] = root(b);
        if (meets_obstacle[b]) meets_obstacle[cluster[b]] = 1;
    }
    for (int& c : cluster)
        if (meets_obstacle[c]) c = -1;
    return cluster;
}

}  // namespace nbd
