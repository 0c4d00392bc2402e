#include "sim/barrier/barrier_solver.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace nbd {
namespace {

/// Share of a linearisation's residual that its linear solve may leave. Smaller ones cost more, and Newton
/// takes as many iterations.
constexpr double residual_share = 0.1;

}  // namespace

void BarrierSolver::begin_step(std::span<const ContactSurface* const> surfaces,
                               std::span<const int> first_unknown, double slip_velocity, double dt,
                               std::vector<FrictionContact> friction) {
    surfaces_ = surfaces;
    first_unknown_ = first_unknown;
    slip_velocity_ = slip_velocity;
    dt_ = dt;
    friction_ = std::move(friction);
    friction_terms_.clear();
    for (const FrictionContact& f : friction_) friction_terms_.add(f.contact, surfaces_, first_unknown_);
}

void BarrierSolver::set_contacts(std::vector<BarrierContact> contacts) {
    contacts_ = std::move(contacts);
    terms_.clear();
    for (const BarrierContact& c : contacts_) terms_.add(c.contact, surfaces_, first_unknown_);
    for (const FrictionContact& f : friction_) terms_.add(f.contact, surfaces_, first_unknown_);
}

/// Velocity of sliding of a friction contact, m/s.
Eigen::Vector3d BarrierSolver::slip(std::size_t contact, const Eigen::VectorXd& v) const {
    const Contact& c = friction_[contact].contact;
    const Eigen::Vector3d u = friction_terms_.velocity(contact, v) - c.wall_velocity;
    return u - c.normal.dot(u) * c.normal;
}

/// Impulse over velocity of sliding, kg.
double BarrierSolver::drag(std::size_t contact, double slip) const {
    const FrictionContact& f = friction_[contact];
    return f.contact.friction * f.normal_impulse / std::max(slip, slip_velocity_);
}

double BarrierSolver::friction_potential(const Eigen::VectorXd& v) const {
    double sum = 0;
    for (std::size_t f = 0; f < friction_.size(); ++f) {
        const double speed = slip(f, v).norm(), edge = slip_velocity_;
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

LinearSolveReport BarrierSolver::solve(std::span<const StepSystem> systems, double wall_left,
                                       Eigen::VectorXd& v) {
    terms_.hold(systems);
    couplings_.clear();
    rhs_.resize(first_unknown_.back());
    for (std::size_t b = 0; b < systems.size(); ++b)
        rhs_.segment(first_unknown_[b], systems[b].rhs().size()) = systems[b].rhs();
    for (std::size_t c = 0; c < contacts_.size(); ++c) {
        const BarrierContact& barrier = contacts_[c];
        const Eigen::Vector3d& n = barrier.contact.normal;
        const Eigen::Matrix3d A = dt_ * dt_ * barrier.curvature * n * n.transpose();
        couplings_.push_back(terms_.coupling(c, A));
        const Eigen::Vector3d reached = terms_.velocity(c, v) + wall_left * barrier.contact.wall_velocity;
        terms_.add_impulse(c, A * reached - dt_ * barrier.slope * n, false, rhs_);
    }
    for (std::size_t f = 0; f < friction_.size(); ++f) {
        const Eigen::Vector3d& n = friction_[f].contact.normal;
        const Eigen::Matrix3d A =
            drag(f, slip(f, v).norm()) * (Eigen::Matrix3d::Identity() - n * n.transpose());
        couplings_.push_back(terms_.coupling(contacts_.size() + f, A));
        terms_.add_impulse(contacts_.size() + f, A * friction_[f].contact.wall_velocity, false, rhs_);
    }
    const CoupledSystem system{systems, first_unknown_, terms_.all(), couplings_};
    for (std::size_t b = 0; b < systems.size(); ++b)
        for (int i = 0; i < systems[b].body().node_count(); ++i)
            if (systems[b].is_prescribed(i))
                v.segment<3>(first_unknown_[b] + 3 * i) = systems[b].rhs().segment<3>(3 * i);
    linear_.begin_matrices(system);
    product_.resize(v.size());
    system.multiply(v, product_);
    return linear_.solve(system, rhs_, residual_share * (rhs_ - product_).norm(), v);
}

}  // namespace nbd
