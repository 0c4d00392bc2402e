#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sim/contact/bond.hpp"
#include "sim/contact/contact.hpp"
#include "sim/contact/contact_force.hpp"
#include "sim/contact/contact_terms.hpp"
#include "sim/contact/friction_memory.hpp"
#include "sim/contact/mean_place.hpp"
#include "sim/fem/step_system.hpp"
#include "sim/patches/contact_shape.hpp"
#include "sim/solvers/coupled_solver.hpp"

namespace nbd {

/// What contacts give to one of two surfaces over a step.
struct PairImpulse {
    int body = 0, other = 0;  // what is pushed, the body with the smaller number, and by what, see PairRules
    Eigen::Vector3d linear = Eigen::Vector3d::Zero();   // N s
    Eigen::Vector3d angular = Eigen::Vector3d::Zero();  // about the origin, N m s
    MeanPlace place{};                                  // where they act
};

struct ContactSolveReport {
    int linear_iterations = 0;  // conjugate gradient iterations, over all passes
    int passes = 0;             // linear solves with updated contacts
    int active = 0;             // contacts that press at the end of the step
    bool converged = true;      // every linear solve met its tolerance
    bool settled = true;        // the last pass changed nothing about which contacts press and slip
    std::string fallback{};     // empty, or why a pass was factorised

    /// Sets this to what the next solve of the same step did, and counts the work of those before it, too.
    void add_round(ContactSolveReport next) {
        next.linear_iterations += linear_iterations;
        next.passes += passes;
        if (next.fallback.empty()) next.fallback = std::move(fallback);
        *this = std::move(next);
    }
};

/// Solves the velocities of all bodies at the end of a step together with their contacts and bonds:
///
///   A_i v_i + sum over contacts J_i^T (A_c J v - b_c) = b_i
///
/// J maps velocities to the relative velocity of a contact's points, so forces are equal and opposite. The
/// linear solve (see CoupledSolver) is repeated from its last solution to settle which contacts press and
/// slip, and how hard barriers press, until the residual with the updated contacts is small enough. Each
/// solve is only as accurate as needed, and taken as far only as it lowers the potential of what presses.
/// Friction is a drag, which is constant in a solve and then set anew, after eight accurate passes at most,
/// where the friction between two bodies does not fit their normal forces to a two-thousandth. Residuals are
/// judged body by body, see share_of_scales(): how fast a body moves as a whole, or how heavy and fast others
/// are, does not matter. A contact that lets go for the second time presses without friction from then on.
class ContactSolver {
 public:
    /// Of solve(). A barrier is far from its tangent at first.
    static constexpr int most_passes = 100;

    explicit ContactSolver(const LinearSolveConfig& config,
                           std::shared_ptr<RestHierarchies> hierarchies = nullptr)
        : linear_tolerance_(config.tolerance), linear_(config, std::move(hierarchies)) {}

    /// Sets the contacts and bonds of a step; the velocities before it, v (stacked, prescribed ones in
    /// place), give the first guess of how they press and slip. shapes: one per body. first_unknown: start of
    /// each body's velocities in the stacked vector, then its length. tolerance: see ContactConfig. steps: of
    /// each body, of one length; bodies that bonds join have the same.
    /// each_contact: whether friction must be right at each contact rather than between each two bodies, as
    /// Newton's iteration needs it, whose residual has all of them. tangents: whether a contact that slides
    /// has the tangent of its friction, with the normal impulse at v, instead of a drag: solves are then
    /// steps of Newton's method in the slip. All arguments but these two must outlive solve().
    void begin(std::span<const Contact> contacts, std::span<const Bond> bonds,
               std::span<const ContactShape* const> shapes, std::span<const int> first_unknown,
               double tolerance, std::span<const TimeStep> steps, const Eigen::VectorXd& v, bool each_contact,
               bool tangents = false);
    /// Lets solves of the step, until the next begin(), leave this share of what their tolerances allow.
    void solve_to(double share) noexcept;
    /// Others for the same step, as seen from its iterate v.
    void set_contacts(std::span<const Contact> contacts, std::span<const Bond> bonds,
                      const Eigen::VectorXd& v);

    /// systems: assembled and prescribed. v: initial guess on entry, velocities at the end of the step on
    /// return.
    ContactSolveReport solve(std::span<const StepSystem> systems, Eigen::VectorXd& v);
    /// Takes the laws of bonds as they are now, which may have other tensions, and linearises them at v.
    void renew_bonds(const Eigen::VectorXd& v) { linearise_bonds(v); }

    /// The largest norm of a body's part of r, an impulse, as a share of its scale, without bodies of which
    /// `rounding` has a larger norm. A scale is the size of the body's impulses in the step, in the norms of
    /// CoupledSolver::norms(): of loads and elasticity at its start, the guess of what changes, and the
    /// contacts of the last solve(). The first solve() after begin() takes them.
    double share_of_scales(const Eigen::VectorXd& r, const Eigen::VectorXd& rounding) const;

    /// Linearises the contacts and bonds at velocities v.
    void linearise(const Eigen::VectorXd& v);

    /// Impulses of contacts and bonds on the nodes over the step at end velocities v, linearised by the last
    /// linearise() or solve(). Newton seconds, stacked like v; includes nodes with prescribed velocity.
    Eigen::VectorXd impulses(const Eigen::VectorXd& v) const;

    /// Likewise of contacts alone, with those of a response. of_each: see RigidResponse; may be empty.
    Eigen::VectorXd contact_impulses(const Eigen::VectorXd& v,
                                     std::span<const Eigen::Vector3d> of_each) const;

    /// Likewise of contacts and of bonds that are no springs: those that act in this step alone.
    Eigen::VectorXd step_impulses(const Eigen::VectorXd& v) const;

    /// What all impulses give to the momentum of each body. Bonds act where Bond::acts_at says, contacts at
    /// the middles. But the middles of two bodies of different rules are not of one time, and the way that
    /// both have in common would be an arm: there a contact acts at the starts.
    std::vector<Momentum> momenta(const Eigen::VectorXd& v, const ImpulsePlaces& at) const;

    /// What impulses on bodies as a whole do at the end of a step while its contacts resist.
    struct RigidResponse {
        std::vector<RigidVector> motions;      // [bodies] zero where something holds the body
        Eigen::VectorXd impulses;              // of contacts and bonds on the nodes, N s, stacked like v
        std::vector<Eigen::Vector3d> of_each;  // [contacts + bonds] on their points a, N s
    };
    /// v: the solution of the step. impulses: [bodies]. inertia: [bodies], with what of the damping resists;
    /// none of a body that something holds. Contacts resist as they were last linearised, also where they
    /// would let go or begin to slip, at the ends; bonds where Bond::acts_at says.
    RigidResponse response(const Eigen::VectorXd& v, std::span<const RigidVector> impulses,
                           std::span<const std::optional<RigidMatrix>> inertia,
                           const ImpulsePlaces& at) const;
    /// The impulses at v and those of a response, by bodies and obstacles that touch, in a fixed order;
    /// without those within a body. of_each: see RigidResponse; may be empty. at: see momenta().
    std::vector<PairImpulse> pair_impulses(const Eigen::VectorXd& v, std::span<const Eigen::Vector3d> of_each,
                                           const ImpulsePlaces& at) const;

    /// The bodies that something else presses on: [bodies].
    std::vector<char> pressed_bodies() const;

    /// The contacts that press, at velocities v at the end of the step. They refer to those of begin().
    std::vector<RubbedContact> rubbed(const Eigen::VectorXd& v) const;

    /// The impulse of a bond on its point a over the step at v, linearised likewise, with that of a response,
    /// N s. of_each: see RigidResponse; may be empty.
    Eigen::Vector3d bond_impulse(std::size_t bond, const Eigen::VectorXd& v,
                                 std::span<const Eigen::Vector3d> of_each = {}) const;
    /// Where it acts, see momenta().
    Eigen::Vector3d bond_place(std::size_t bond, const ImpulsePlaces& at) const;

    /// Potential of the bonds at velocities v, with half the work of their damping, joules.
    double bond_potential(const Eigen::VectorXd& v) const;

    /// Potential of friction at velocities v, joules, for the normal impulses that contacts have at
    /// `friction_at`.
    double friction_potential(const Eigen::VectorXd& v, const Eigen::VectorXd& friction_at) const;

    /// Normal impulses of the contacts on the nodes over the step at v, not linearised. Newton seconds,
    /// stacked like v; nodes with prescribed velocity get none.
    Eigen::VectorXd normal_impulses(const Eigen::VectorXd& v) const;

 private:
    Eigen::Vector3d relative_velocity(std::size_t contact, const Eigen::VectorXd& v) const;
    ContactImpulse impulse(std::size_t contact, const Eigen::VectorXd& v) const;
    void number_pairs();
    void set_first_operator(std::size_t contact, const Eigen::VectorXd& v);
    /// A contact at some velocities.
    struct Rub {
        ContactImpulse impulse;
        double most = 0;                                 // friction at most, N s
        Eigen::Vector3d slip = Eigen::Vector3d::Zero();  // m/s
    };
    std::vector<Rub> rubs_at(const Eigen::VectorXd& v, bool solved) const;
    Eigen::Vector3d friction_off(std::size_t contact, const Rub& rub) const;
    std::vector<bool> wrong_pairs(const std::vector<Rub>& rubs) const;
    void linearise(const Eigen::VectorXd& v, bool solved, bool renews);
    BondLaw::Terms bond_terms(std::size_t bond, const Eigen::VectorXd& v) const;
    void linearise_bonds(const Eigen::VectorXd& v);
    Eigen::Vector3d linear_impulse(std::size_t index, const Eigen::VectorXd& v) const {
        return push_[index] - operators_[index].A * terms_.velocity(index, v);
    }
    struct Touch;
    std::vector<Touch> touches(const Eigen::VectorXd& v, std::span<const std::optional<RigidMatrix>> inertia,
                               const ImpulsePlaces& at) const;
    void set_operator(std::size_t contact, const ContactImpulse& impulse, double drag);
    void set_tangent(std::size_t contact, const ContactImpulse& impulse, double most,
                     const Eigen::Vector3d& slip);
    double next_drag(std::size_t contact, double most, double slip) const;
    Eigen::VectorXd impulses(const Eigen::VectorXd& v, bool held, bool of_step_alone = false) const;
    const BodyPositions& place_of(std::size_t index, const ImpulsePlaces& at) const;
    bool acts_in_step_alone(std::size_t index) const {
        return index < contacts_.size() || !bonds_[index - contacts_.size()].is_spring;
    }
    bool go_back(const Eigen::VectorXd& begin, Eigen::VectorXd& v);
    bool set_goals(std::vector<double>& goals) const;
    void set_rhs(std::span<const StepSystem> systems);
    void measure_step(std::span<const StepSystem> systems, const Eigen::VectorXd& v);
    void measure_contacts(std::span<const StepSystem> systems, const Eigen::VectorXd& v);
    bool presses(std::size_t contact) const { return !operators_[contact].A.isZero(0); }

    std::span<const Contact> contacts_;
    std::span<const Bond> bonds_;  // their numbers below follow those of the contacts
    std::span<const ContactShape* const> shapes_;
    std::span<const int> first_unknown_;
    std::span<const TimeStep> steps_;
    double settled_share_ = 0, dt_ = 0;
    bool each_contact_ = false, tangents_ = false;
    std::vector<std::array<int, 2>> pairs_;  // bodies of contacts, the larger first; -1: the obstacles
    std::vector<std::size_t> pair_of_;       // [contacts + bonds]
    ContactTerms terms_;
    std::vector<Coupling> operators_;    // [contacts + bonds] from the last linearise()
    std::vector<Eigen::Vector3d> push_;  // [contacts + bonds] b of the impulses, from the last linearise()
    std::vector<Coupling> solved_by_;    // operators_ and push_ of the last solve
    std::vector<Eigen::Vector3d> solved_push_;
    std::vector<int> releases_;  // [contacts] how often they let go between passes
    /// A drag, impulse over slip, and the slip that a solve found with it.
    struct Drag {
        double drag = 0, slip = 0;  // kg, m/s
    };
    /// Friction whose tangent a contact has.
    struct Slide {
        double most = 0;                                 // N s
        Eigen::Vector3d slip = Eigen::Vector3d::Zero();  // m/s
    };
    std::vector<Slide> slides_;               // [contacts]
    std::vector<Drag> drags_, drags_before_;  // [contacts] of the last two solves; slip 0: not known
    double linear_tolerance_;                 // of the linear solves, relative to yielding_scales_
    double tolerance_ = linear_tolerance_;    // likewise, see solve_to()
    Eigen::VectorXd start_;                   // velocities before the step
    std::vector<double> step_impulses_;       // [bodies] scales_ without contacts; empty: not measured yet
    std::vector<double> scales_;              // [bodies] see share_of_scales()
    // [bodies] likewise, with impulses on each node times its StepSystem::softness(). By these, what a solve
    // leaves does not grow from step to step where a body is stiff.
    std::vector<double> yielding_impulses_, yielding_scales_;
    CoupledSolver linear_;
    Eigen::VectorXd rhs_, product_;
    Eigen::VectorXd left_, change_;  // the residual after a pass, and what the update of contacts did to it
};

}  // namespace nbd
