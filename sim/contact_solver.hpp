#pragma once

#include <Eigen/Core>
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
    /// Takes the contacts of a step. surfaces: one a body; first_unknown: where each body's velocities begin
    /// in the stacked vector, and its length at the end.
    void begin(std::span<const Contact> contacts, std::span<const ContactSurface* const> surfaces,
               std::span<const int> first_unknown);

    /// systems: assembled, neither prescribed nor factorised. Adds the contacts as they are expected from
    /// velocities v (stacked) to the matrices. thickness: metres; dt: seconds.
    void precondition(std::span<StepSystem> systems, const ContactConfig& config, double thickness, double dt,
                      const Eigen::VectorXd& v);

    /// systems: prescribed and factorised since precondition(). v: in, the velocities at the start of the
    /// step; out, those at its end.
    ContactSolveReport solve(std::span<StepSystem> systems, const ContactConfig& config, double thickness,
                             double dt, Eigen::VectorXd& v);

 private:
    /// A node's share in the relative velocity of a contact.
    struct Term {
        int body = 0, node = 0, unknown = 0;  // unknown: row of the node's x velocity in the stacked vector
        double weight = 0;
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
    void linearise(const ContactConfig& config, double thickness, double dt, const Eigen::VectorXd& v);
    void add_to_matrix(StepSystem& system, LowRank part);
    void multiply(std::span<StepSystem> systems, const Eigen::VectorXd& v, Eigen::VectorXd& out) const;
    void clear_prescribed(std::span<StepSystem> systems, Eigen::VectorXd& v) const;
    void apply_factors(std::span<StepSystem> systems, const Eigen::VectorXd& r, Eigen::VectorXd& z) const;
    bool conjugate_gradients(std::span<StepSystem> systems, double goal, Eigen::VectorXd& v, int& iterations);
    void set_rhs(std::span<StepSystem> systems);
    std::vector<bool> pressing() const;

    std::span<const Contact> contacts_;
    std::span<const int> first_unknown_;
    std::vector<Term> terms_;
    std::vector<int> middle_;            // [contacts] where side b's terms begin
    std::vector<LowRank> operators_;     // [contacts] as of the last linearise()
    std::vector<Eigen::Vector3d> push_;  // [contacts] b of the contacts' impulses, likewise
    std::vector<LowRank> in_matrix_;     // what precondition() added to the bodies' matrices
    Eigen::VectorXd rhs_, r_, z_, p_, Ap_;
};

}  // namespace nbd
