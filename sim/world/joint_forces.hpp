#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sim/world/reactions.hpp"
#include "sim/world/step_equations.hpp"
#include "sim/world/world_state.hpp"

// The joints of a world in a part of a step.
namespace nbd {

/// The bonds of all joints in a part as seen from its iterate v, those of tendons without their tensions.
/// caught: see caught_bodies().
std::vector<Bond> bonds_at(const WorldState& world, const Eigen::VectorXd& v, std::span<const char> caught);

/// Which joint is not what it should be at the end of a part; empty: none. v: its solution.
std::string joint_fault(const WorldState& world, std::span<const Bond> bonds, const Eigen::VectorXd& v);

/// Which bodies that take a step of second order are caught in a part by ropes and tendons that do not
/// stretch, or by limits, since they move otherwise than these let them: [bodies]. v: the solution of the
/// part.
std::vector<char> caught_bodies(const WorldState& world, const StepEquations& equations,
                                const Eigen::VectorXd& v);

/// What the springs of joints did on their bodies, now and a step before.
class JointForces {
 public:
    void add_joint() { before_.emplace_back(); }
    /// [joints] at the start of the last step.
    const std::vector<JointLoad>& before() const noexcept { return before_; }
    void set_before(std::vector<JointLoad> before) { before_ = std::move(before); }

    /// Forces of springs on the nodes of each body where these are now, newtons, which it knows from then on.
    /// Where the last step of a body is not known, those before it are taken to be as now. dt: length of the
    /// step that begins.
    std::vector<Nodes> measure(const WorldState& world, double dt);
    /// At the end of a part: what was now is before.
    void go_on() { before_ = now_; }
    /// Takes those on some bodies a step before to be as now, after it. bodies: [bodies].
    void forget(const WorldState& world, std::span<const char> bodies);

    /// What the springs of a joint have added to the step by their forces before its end, impulses.
    JointLoad earlier(const WorldState& world, std::size_t joint) const;
    /// Likewise all springs on a body.
    Momentum earlier_on(const WorldState& world, int body) const;

    /// Adds what joints did to their bodies in a part whose solution is v. rate: 1/s, of the reactions by
    /// impulses. more: impulses of a response, of each contact and bond.
    void add_reactions(const WorldState& world, const StepEquations& equations, double rate,
                       const Eigen::VectorXd& v, std::span<const Eigen::Vector3d> more,
                       const ImpulsePlaces& at, ReactionSums& reactions) const;

    /// Breaks the joints whose force in the part is more than they bear. v: the solution of the part.
    void break_joints(WorldState& world, const StepEquations& equations, const Eigen::VectorXd& v);

 private:
    std::vector<JointLoad> now_, before_;  // [joints]
};

}  // namespace nbd
