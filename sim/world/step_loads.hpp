#pragma once

#include <Eigen/Core>
#include <vector>

#include "sim/fem/step_system.hpp"
#include "sim/world/reactions.hpp"
#include "sim/world/world_state.hpp"

// Gravity, outer forces, winds and muscles in a part of a step, and how they answer to its motion. Forces of
// muscles turn with the body, those of winds fall with its velocities. Like a contact, a wind acts with its
// whole impulse in a step, as it is at its end: so air at rest takes energy in steps of any length.
namespace nbd {

/// What acts with the weights of the rates before the part: a load that changes in time as its value now and
/// that at the start of the last part. A load that follows its body has the pose of now in both.
void begin_outer_forces(WorldState& world, const TwoStepWeights& weights);

/// Forces of loads at the end of the part on a body whose nodes are at x, [N, 3] newtons.
Nodes end_forces(const WorldState& world, const SteppedBody& body, const Nodes& x);

/// Sets gravity and forces at the end of the part. x: the pose at which it is linearised.
void set_end_forces(const WorldState& world, SteppedBody& body, const Nodes& x);

/// What acts at the end of the part, as it was linearised last; the first without gases and winds.
Loads outer_end_loads(const WorldState& world, const SteppedBody& body);
Loads end_loads(const WorldState& world, const SteppedBody& body);

/// By how much the loads that follow a body do less work on the way between two iterates of a step than as
/// they were in the first, as StepPotential counts it, joules. Exact for pressures, whose forces are
/// quadratic along a straight way.
double excess_work(const WorldState& world, const SteppedBody& body, const Nodes& from, const Nodes& to);

/// By how much loads that follow a body act otherwise where the unknowns v of the step lead than was solved
/// for, as a share of their forces. The largest of all bodies.
double follow_error(const WorldState& world, const Eigen::VectorXd& v);

/// Takes the winds out of the loads of a body that is being added.
void take_winds(SteppedBody& body, std::vector<BodyLoad>& loads);

/// Linearises the winds and muscles of a body at its unknown w, as they are at the end of the part.
void linearise_loads(const WorldState& world, SteppedBody& body, const Nodes& w);

/// Of all winds on a body: their forces times its c, so that their whole impulses act in the step.
Nodes drag_forces(const SteppedBody& body, const Nodes& w);

/// By what the forces of muscles change up to the unknown w of a step, [N, 3] newtons.
Nodes spring_forces(const WorldState& world, const SteppedBody& body, const Nodes& w);

/// Lets the system of a body answer to its unknown as its winds and muscles do.
void add_tangents(const WorldState& world, const SteppedBody& body, const Nodes& w, StepSystem& system);

/// What winds add to the potential of the step of a body at its unknown w, in the pose in which they were
/// linearised last, joules.
double drag_energy(const WorldState& world, const SteppedBody& body, const Nodes& w);

/// By how much winds at the unknowns v of the step act otherwise than was solved for, as a share of what they
/// do, or of a hundredth of what changes the motion of their body. The largest of all bodies.
double drag_error(const WorldState& world, const Eigen::VectorXd& v);

/// Adds what winds did on a body in a part whose unknown is w. x: where it acts, [N, 3].
void add_wind_reactions(const WorldState& world, double share, int index, const Nodes& w, const Nodes& x,
                        ReactionSums& reactions);

}  // namespace nbd
