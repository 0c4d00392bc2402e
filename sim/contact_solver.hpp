#pragma once

#include <Eigen/Core>
#include <functional>
#include <span>
#include <vector>

#include "sim/contact.hpp"
#include "sim/contact_force.hpp"
#include "sim/contact_surface.hpp"
#include "sim/step_system.hpp"

namespace nbd {

struct ContactSolveReport {
    int linear_iterations = 0;  // of conjugate gradients, over all passes
    int passes = 0;             // linear solves with contacts settled anew
    int rebuilds = 0;           // factorisations beyond the first
    int active = 0;             // contacts that press at the end of the step
    bool converged = true;      // every linear solve met its tolerance
};

/// Solves the velocities of all bodies at the end of a step together with their contacts:
///
///   A_i v_i + sum over contacts J_i^T (A_c J v - b_c) = b_i
///
/// J takes velocities to the relative velocity of a contact's points, so forces are equal and opposite.
/// Contacts go into each body's own matrix as far as its pattern allows; what couples bodies is applied as a
/// low-rank term, and conjugate gradients with the bodies' Cholesky factors as preconditioner solve the
/// whole. Which contacts press and slip is settled by repeating the solve, with the same factors.
class ContactSolver {
 public:
    /// Takes the contacts of a step and how they are expected to press and slip from velocities v (stacked).
    /// surfaces: one a body; first_unknown: where each body's velocities begin in the stacked vector, and its
    /// length at the end. thickness: metres; dt: seconds. What is passed must outlive solve().
    void begin(std::span<const Contact> contacts, std::span<const ContactSurface* const> surfaces,
               std::span<const int> first_unknown, const ContactConfig& config, double thickness, double dt,
               const Eigen::VectorXd& v);

    /// Adds the contacts, as they are expected now, to the matrices. systems: just assembled.
    void add_to_matrices(std::span<StepSystem> systems);

    /// systems: prescribed and factorised since add_to_matrices(). rebuild: must assemble them anew, call
    /// add_to_matrices(), prescribe and factorise; called where the contacts have changed so much that the
    /// factors no longer help. v: out, the velocities at the end of the step.
    ContactSolveReport solve(std::span<StepSystem> systems, const std::function<void()>& rebuild,
                             Eigen::VectorXd& v);

    /// Impulses of the contacts on the nodes over the step at these end velocities, as of the last solve():
    /// newton seconds, stacked like v. Nodes whose velocity is prescribed included.
    Eigen::VectorXd impulses(const Eigen::VectorXd& v) const;

 private:
    /// A node's share in the relative velocity of a contact.
    struct Term {
        int body = 0, node = 0, unknown = 0;  // unknown: row of the node's x velocity in the stacked vector
        double weight = 0;
        bool held = false;  // the node's velocity is prescribed: it has no equation
    };
    /// J^T A J, J given by a range of terms.
    struct LowRank {
        int begin = 0, end = 0;
        Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
    };

    int add_terms(const SurfacePoint& point, double sign, std::span<const ContactSurface* const> surfaces);
    std::span<const Term> terms(int begin, int end) const;
    Eigen::Vector3d velocity(int begin, int end, const Eigen::VectorXd& v) const;
    void add_product(const LowRank& matrix, double sign, const Eigen::VectorXd& v,
                     Eigen::VectorXd& out) const;
    void linearise(const Eigen::VectorXd& v);
    void add_to_matrix(StepSystem& system, LowRank part);
    void multiply(std::span<StepSystem> systems, const Eigen::VectorXd& v, Eigen::VectorXd& out) const;
    void couple(std::size_t earlier, bool forward, const Eigen::VectorXd& z, Eigen::VectorXd& out) const;
    void solve_body(StepSystem& system, std::size_t body, Eigen::VectorXd& v) const;
    void apply_preconditioner(std::span<StepSystem> systems, const Eigen::VectorXd& r, Eigen::VectorXd& z);
    void order_bodies(std::span<StepSystem> systems);
    void mark_held(std::span<StepSystem> systems);
    bool conjugate_gradients(std::span<StepSystem> systems, int most_iterations, Eigen::VectorXd& v,
                             int& iterations);
    void set_rhs(std::span<StepSystem> systems);
    std::vector<bool> pressing() const;

    std::span<const Contact> contacts_;
    std::span<const int> first_unknown_;
    const ContactConfig* config_ = nullptr;
    double thickness_ = 0, dt_ = 0;
    std::size_t contact_terms_ = 0;  // terms_ that belong to contacts; parts of in_matrix_ may follow
    std::vector<Term> terms_;
    std::vector<int> middle_;                        // [contacts] where side b's terms begin
    std::vector<LowRank> operators_;                 // [contacts] as of the last linearise()
    std::vector<Eigen::Vector3d> push_;              // [contacts] b of the contacts' impulses, likewise
    std::vector<LowRank> expected_;                  // [contacts] operators_ as add_to_matrices() took them
    std::vector<LowRank> in_matrix_;                 // what add_to_matrices() added
    std::vector<std::size_t> order_;                 // bodies, from soft to stiff
    std::vector<std::vector<std::size_t>> coupled_;  // [bodies] contacts with a later body in that order
    double goal_ = 0;  // squared norm of the residual to reach, in the preconditioner's norm
    Eigen::VectorXd rhs_, r_, z_, p_, Ap_, coupling_;
};

}  // namespace nbd
