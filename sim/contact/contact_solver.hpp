#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "sim/contact/contact.hpp"
#include "sim/contact/contact_force.hpp"
#include "sim/contact/contact_surface.hpp"
#include "sim/fem/step_system.hpp"
#include "sim/solvers/coupled_solver.hpp"

namespace nbd {

struct ContactSolveReport {
    int linear_iterations = 0;  // of conjugate gradients, over all passes
    int passes = 0;             // linear solves with contacts settled anew
    int active = 0;             // contacts that press at the end of the step
    int patch_nodes = 0;        // most nodes that a pass solved exactly
    bool converged = true;      // every linear solve met its tolerance
    std::string fallback{};     // empty, or why a pass was factorised after all
};

/// Solves the velocities of all bodies at the end of a step together with their contacts:
///
///   A_i v_i + sum over contacts J_i^T (A_c J v - b_c) = b_i
///
/// J takes velocities to the relative velocity of a contact's points, so forces are equal and opposite.
/// Which contacts press and slip is settled by repeating the linear solve (see CoupledSolver) from where the
/// last one ended, each as accurate as that is worth, until the residual with the contacts as they then are
/// is small enough.
class ContactSolver {
 public:
    explicit ContactSolver(const LinearSolveConfig& config, std::shared_ptr<RestFactors> factors = nullptr)
        : tolerance_(config.tolerance), linear_(config, std::move(factors)) {}

    /// Takes the contacts of a step and how they are expected to press and slip from velocities v (stacked).
    /// surfaces: one a body; first_unknown: where each body's velocities begin in the stacked vector, and its
    /// length at the end. thickness: metres; dt: seconds. What is passed must outlive solve().
    void begin(std::span<const Contact> contacts, std::span<const ContactSurface* const> surfaces,
               std::span<const int> first_unknown, const ContactConfig& config, double thickness, double dt,
               const Eigen::VectorXd& v);

    /// systems: assembled and prescribed. v: in, a guess; out, the velocities at the end of the step.
    ContactSolveReport solve(std::span<const StepSystem> systems, Eigen::VectorXd& v);

    /// Takes the contacts as they press and slip at velocities v.
    void linearise(const Eigen::VectorXd& v);

    /// Impulses of the contacts on the nodes over the step at these end velocities, as of the last
    /// linearise() or solve(): newton seconds, stacked like v. Nodes whose velocity is prescribed included.
    Eigen::VectorXd impulses(const Eigen::VectorXd& v) const;

    /// Potential of all contacts at velocities v, friction as strong as at `friction_at`; see
    /// contact_potential(). Joules.
    double potential(const Eigen::VectorXd& v, const Eigen::VectorXd& friction_at) const;

 private:
    int add_terms(const SurfacePoint& point, double sign, std::span<const ContactSurface* const> surfaces);
    std::span<const CouplingTerm> terms(int begin, int end) const;
    Eigen::Vector3d velocity(int begin, int end, const Eigen::VectorXd& v) const;
    Eigen::Vector3d relative_velocity(std::size_t contact, const Eigen::VectorXd& v) const;
    void linearise(const Eigen::VectorXd& v, bool keep_drag);
    void set_rhs(std::span<const StepSystem> systems);
    double free_norm(std::span<const StepSystem> systems) const;
    bool presses(std::size_t contact) const { return !operators_[contact].A.isZero(0); }

    std::span<const Contact> contacts_;
    std::span<const int> first_unknown_;
    const ContactConfig* config_ = nullptr;
    double thickness_ = 0, dt_ = 0;
    std::vector<CouplingTerm> terms_;
    std::vector<Coupling> operators_;    // [contacts] as of the last linearise()
    std::vector<Eigen::Vector3d> push_;  // [contacts] b of the contacts' impulses, likewise
    double tolerance_;                   // of the linear solves
    CoupledSolver linear_;
    Eigen::VectorXd rhs_, product_;
};

}  // namespace nbd
