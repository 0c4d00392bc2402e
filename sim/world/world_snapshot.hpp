#pragma once

#include <vector>

#include "sim/contact/contact_sides.hpp"
#include "sim/fem/step_system.hpp"

namespace nbd {

/// Everything that the next step depends on besides bodies, obstacles and external forces. An identically
/// built world continues from it with the same bits. Arrays only, in double, so that a file can store them.
struct WorldSnapshot {
    double time = 0;                // seconds
    double dt_before = 0;           // length of the part of a step that led here, seconds; 0: none
    std::vector<BodyState> bodies;  // positions and velocities, one per body
    ContactSides sides;
};

}  // namespace nbd
