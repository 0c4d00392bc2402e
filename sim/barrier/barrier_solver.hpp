#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

#include "sim/barrier/barrier.hpp"
#include "sim/contact/contact_terms.hpp"
#include "sim/contact/friction_memory.hpp"
#include "sim/solvers/coupled_solver.hpp"

namespace nbd {

/// A contact that rubs with the normal force of some iterate.
struct FrictionContact {
    Contact contact;
    double normal_impulse = 0;  // N s, >= 0
};

/// Velocities of all bodies at the end of a step with the contacts of a Barrier: one linearisation of
///
///   gradient of (sum of the bodies' StepPotential + barrier + friction) = 0
///
/// in the stacked velocities v. The barrier's second derivative is taken along the line between the closest
/// points alone, so that the system is positive definite. Friction has the normal forces and closest points
/// of an iterate, and Contact::slip() of the velocities at the end of the step: constant size from
/// full_slip() on, and linear below it.
class BarrierSolver {
 public:
    explicit BarrierSolver(const LinearSolveConfig& config, std::shared_ptr<RestHierarchies> hierarchies)
        : linear_(config, std::move(hierarchies)) {}

    /// What `surfaces` and `first_unknown` point to must stay valid while contacts are set.
    void begin_step(std::vector<const ContactSurface*> surfaces, std::span<const int> first_unknown,
                    double dt);

    /// The contacts of the current iterate, and those that rub.
    void set_contacts(std::vector<BarrierContact> contacts, std::vector<FrictionContact> friction);
    /// Contacts of another iterate; those that rub stay.
    void set_contacts(std::vector<BarrierContact> contacts);

    /// Linearises at v. systems: assembled at v and prescribed; they must stay as they are until solve().
    /// wall_left: share of the step that obstacles still have before them. is_near: whether v is near the
    /// solution; far from it, friction is linearised as if it grew with slip, which is safe. v: prescribed
    /// velocities are put in place.
    void linearise(std::span<const StepSystem> systems, double wall_left, bool is_near, Eigen::VectorXd& v);

    /// What is missing to the balance of impulses at the v of linearise(), newton seconds, stacked like v;
    /// zero at nodes with prescribed velocities. It is minus the gradient, without an approximation, where
    /// obstacles and prescribed nodes are at their end.
    const Eigen::VectorXd& residual() const noexcept { return residual_; }

    /// By how much rounding of positions may change residual() at each node, newton seconds for a largest
    /// coordinate of one metre; it grows with the coordinate. [unknowns / 3].
    Eigen::VectorXd rounding() const;

    /// Solves the linearised system. v: that of linearise() on entry, solution on return.
    LinearSolveReport solve(Eigen::VectorXd& v);

    /// Groups of bodies that contacts connect: for each body, the smallest number in its group; -1 for groups
    /// that touch an obstacle. The contact impulses on each of the other groups sum to zero.
    std::vector<int> clusters() const;

    /// Potential of friction at velocities v, joules.
    double friction_potential(const Eigen::VectorXd& v) const;

    /// Impulses of the contacts on the nodes over the step, friction at v included, newton seconds, stacked
    /// like v; nodes with prescribed velocities included.
    Eigen::VectorXd impulses(const Eigen::VectorXd& v) const;

    /// What these impulses give to the momentum of each body. at: positions at the start of the step.
    std::vector<Momentum> momenta(const Eigen::VectorXd& v, const BodyPositions& at) const;

    /// The contacts that rub, at velocities v at the end of the step. They refer to those that were set.
    std::vector<RubbedContact> rubbed(const Eigen::VectorXd& v) const;

    int contact_count() const noexcept { return contacts_.size(); }

 private:
    CoupledSystem system() const;
    Eigen::Vector3d relative_velocity(std::size_t friction, const Eigen::VectorXd& v) const;
    Eigen::Vector3d slip(std::size_t friction, const Eigen::VectorXd& v) const;
    double drag(std::size_t friction, double slip) const;

    std::vector<const ContactSurface*> surfaces_;
    std::span<const int> first_unknown_;
    double dt_ = 0;
    std::vector<FrictionContact> friction_;
    std::vector<BarrierContact> contacts_;
    ContactTerms friction_terms_, terms_;  // terms_: of contacts_, then of friction_
    std::vector<Coupling> couplings_;
    std::span<const StepSystem> systems_;
    CoupledSolver linear_;
    Eigen::VectorXd rhs_, residual_;
};

}  // namespace nbd
