#pragma once

#include <vector>

#include "sim/contact/contact_sides.hpp"
#include "sim/fem/step_system.hpp"

namespace nbd {

/// Everything that the next step of a world depends on and that its bodies, obstacles and outer forces do
/// not say: a world built alike and restored from it continues with the same bits. Arrays only, in double,
/// so that a file can keep them.
struct WorldSnapshot {
    double time = 0;                // seconds
    double dt_before = 0;           // of the part of a step that led here, seconds; 0: none
    std::vector<BodyState> bodies;  // positions and velocities, one per body
    ContactSides sides;
};

}  // namespace nbd
