#pragma once

#include "sim/world/part_solve.hpp"
#include "sim/world/world_state.hpp"

namespace nbd {

/// Why a part of a step is too long for the approach of a body and a sphere, which the barrier does not see.
/// Only vertices meet a sphere, and the iterates of a step are no motion: a vertex may come to lie behind a
/// sphere whose centre goes beyond it in one step. Before the step, a vertex in the way of the centre is at
/// least a radius ahead of it. So it is still ahead if the two approach by at most a radius, and no more is
/// allowed.
Rejection pass_of_ball(const WorldState& world, double dt);

}  // namespace nbd
