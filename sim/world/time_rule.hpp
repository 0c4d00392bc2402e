#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "sim/fem/momentum.hpp"
#include "sim/world/joint_forces.hpp"
#include "sim/world/world_state.hpp"

// The rule by which a part of a step advances bodies in time: where it starts from, where it ends and with
// which momentum. See TimeIntegrator and TwoStepWeights.
namespace nbd {

/// By how much bodies turn in a time with the velocities that they have, radians: [bodies], 0 of those that
/// something keeps from turning.
std::vector<double> turns_in(const WorldState& world, double dt);
/// Likewise rigid bodies in a part whose solution is v.
std::vector<double> rigid_turns(const WorldState& world, const Eigen::VectorXd& v);

/// Sets where the step starts for each body, with what the rates before it add. Where the last step of a body
/// is not known, or was much shorter, those before it are taken to be as now. A body that turns far takes a
/// step of backward Euler, with all that joints and tendons connect to it. turns: in dt.
void choose_steps(WorldState& world, JointForces& joints, std::span<const double> turns, double dt);

/// Adds all bodies that joints and tendons connect to some: forces of springs act on both sides by one rule.
/// some: [bodies].
void add_joined(const WorldState& world, std::vector<char>& some);

/// Which bodies something holds, or joints connect to a place or to what is held, also by way of others:
/// [bodies].
std::vector<char> anchored_bodies(const WorldState& world);

/// Lets bodies take a step of backward Euler from their state as it is, but for those that are held
/// throughout. abrupt: [bodies]. Returns whether one of them took another one before.
bool take_backward_euler(WorldState& world, std::span<const char> abrupt);

/// Takes the rates before the step of a body to be as now, which its last step is no guide to.
void forget_rates(SteppedBody& body);

/// Radians beyond which a deformable body makes energy in a step of second order.
constexpr double most_deformable_turn = 0.5;
/// Beyond which a rigid body is led astray by straight ways.
constexpr double most_rigid_turn = 0.6;

/// The unknown of the step if the body goes on as before.
Nodes first_iterate(const WorldState& world, const SteppedBody& body);

/// The unknown of the step if velocities change as in the last step: where the linear solver starts. A body
/// that nothing holds, and of whose last step nothing is known, falls.
Nodes likely_velocities(const WorldState& world, const SteppedBody& body);

/// Positions at which the impulses of contacts act. In steps of second order they add to the way, in this
/// step and the next, what they would from the middle of this one: with arms of that time, the angular
/// momentum of two bodies that push each other stays, where steps are equal.
Nodes middle(const WorldState& world, const SteppedBody& body);

/// What loads give to the momentum of a body in the step, at whose end it has the positions x, [N, 3].
Momentum load_impulse(const WorldState& world, int index, NodesRef x);

/// The momentum that a body should have at the end of the step. The solver leaves some of the linear
/// momentum, by its tolerance, and takes or adds angular momentum: it turns a body along straight lines, and
/// neglects how forces turn. loads, contacts: what they give.
Momentum end_momentum(const WorldState& world, const JointForces& joints, int index, const Momentum& loads,
                      const Momentum& contacts);

/// Impulses that the solver found to hold nodes at the velocities w, as StepSystem has them: [held, 3] N s.
/// impulses: of contacts on all nodes, stacked.
Nodes holding_impulses(const WorldState& world, const StepEquations& equations, int index, const Nodes& w,
                       const Eigen::VectorXd& impulses);

/// w: the solution of the step. impulses: those on the nodes that act in it alone, stacked; all: with those
/// of springs. The inner forces that the next step needs are what balances the motion: where elements are
/// stiff, forces evaluated at its end would be mostly what they make of the solver's errors. Held nodes keep
/// the velocity of their straight way; those of a grip that stands or jumps, none.
void advance(WorldState& world, const JointForces& joints, const StepEquations& equations, int index,
             const Nodes& w, const Eigen::VectorXd& impulses, const Eigen::VectorXd& all);

}  // namespace nbd
