#pragma once

#include <Eigen/Core>

#include "sim/fem/momentum.hpp"
#include "sim/world/joint_forces.hpp"
#include "sim/world/world_state.hpp"

// The rule by which a part of a step advances bodies in time: where it starts from, where it ends and with
// which momentum. See TimeIntegrator and TwoStepWeights.
namespace nbd {

/// By how much the fastest of some bodies turns.
struct LargestTurn {
    double angle = 0;  // radians
    int body = -1;
};
/// Of all rigid bodies in a time, and of deformable ones that can turn.
struct LargestTurns {
    LargestTurn rigid{}, deformable{};
};
/// With the velocities that bodies have.
LargestTurns largest_turns(const WorldState& world, double dt);
/// Of rigid bodies in a part whose solution is v.
LargestTurn largest_rigid_turn(const WorldState& world, const Eigen::VectorXd& v);

/// Sets where the step starts for each body, with what the rates before it add. Where the last step of a body
/// is not known, or was much shorter, those before it are taken to be as now, of all bodies: two that touch
/// have to follow the same rule. turns: in dt.
void choose_steps(WorldState& world, JointForces& joints, const LargestTurns& turns, double dt);

/// Radians beyond which a deformable body makes energy in a step of second order.
constexpr double most_deformable_turn = 0.5;
/// Beyond which a rigid body is led astray by straight ways.
constexpr double most_rigid_turn = 0.6;

/// A step from the state of all bodies as it is.
void begin_backward_euler(WorldState& world, double dt);

/// The unknown of the step if the body goes on as before.
Nodes first_iterate(const WorldState& world, const SteppedBody& body);

/// The unknown of the step if velocities change as in the last step: where the linear solver starts. A body
/// that nothing holds, and of whose last step nothing is known, falls.
Nodes likely_velocities(const WorldState& world, const SteppedBody& body);

/// Positions at which the impulses of contacts act. In steps of second order they add to the way, in this
/// step and the next, what they would from the middle of this one: with arms of that time, the angular
/// momentum of two bodies that push each other stays, where steps are equal.
Nodes middle(const WorldState& world, const SteppedBody& body);

/// The momentum that a body should have at the end of the step, at the positions x, [N, 3]. The solver leaves
/// some of the linear momentum, by its tolerance, and takes or adds angular momentum: it turns a body along
/// straight lines, and neglects how forces turn. contacts: what they give.
Momentum end_momentum(const WorldState& world, const JointForces& joints, int index, NodesRef x,
                      const Momentum& contacts);

/// Impulses that the solver found to hold nodes at the velocities w, as StepSystem has them: [held, 3] N s.
/// impulses: of contacts on all nodes, stacked.
Nodes holding_impulses(const WorldState& world, const StepSystem& system, int index, const Nodes& w,
                       const Eigen::VectorXd& impulses);

/// w: the solution of the step. impulses: those on the nodes that act in it alone, stacked; all: with those
/// of springs. The inner forces that the next step needs are what balances the motion: where elements are
/// stiff, forces evaluated at its end would be mostly what they make of the solver's errors. Held nodes keep
/// the velocity of their straight way; those of a grip that stands or jumps, none.
void advance(WorldState& world, const JointForces& joints, const StepSystem& system, int index,
             const Nodes& w, const Eigen::VectorXd& impulses, const Eigen::VectorXd& all);

}  // namespace nbd
