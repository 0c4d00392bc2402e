#pragma once

#include <vector>

#include "sim/fem/backward_euler.hpp"

namespace nbd::test {

/// Static displacements of a body under loads, [N, 3], metres. The `held` nodes have the displacements
/// `held_at` (empty: zero). Takes backward Euler steps long enough for inertia to vanish. One step with one
/// solve is linear elasticity; several steps apply the load gradually and, with several solves each, reach
/// large displacements.
Nodes static_displacements(const ElasticBody& body, const std::vector<int>& held, const Loads& loads,
                           const Nodes& held_at = {}, int load_steps = 1, int newton_iterations = 1);

}  // namespace nbd::test
