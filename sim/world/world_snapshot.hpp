#pragma once

#include <vector>

#include "sim/contact/contact_sides.hpp"
#include "sim/fem/body_state.hpp"

namespace nbd {

/// The state of a world, without its bodies, obstacles and outer forces. A world built from the same ones and
/// restored from a snapshot continues with the same bits. Plain arrays,
/// reals in double, so that a file can keep them exactly.
struct WorldSnapshot {
    double time = 0;                // seconds
    double dt_before = 0;           // length of the part of a step that ended here, seconds; 0: none
    std::vector<BodyState> bodies;  // positions and velocities, one per body
    std::vector<BodyState> before;  // those of the step before, for BDF2; empty arrays or an empty list: none
    // Velocities before the last step, which tell where they head for; empty arrays or an empty list: none.
    std::vector<Nodes> velocities_before;
    ContactSides sides;
};

}  // namespace nbd
