#pragma once

#include <vector>

#include "sim/world/keyed.hpp"

namespace nbd {

/// A cord of a length that is told, without friction: its tension is the same all along its parts. It pulls
/// where it is taut, and a stiffness keeps it from getting longer.
struct Tendon {
    std::vector<int> parts;  // joints that are cords with a given tension, which this sets instead
    double fixed = 0;        // length of parts between points of the world, metres
    Keyed<double> winch{};   // its whole length at rest, metres, > 0
    double stiffness = 0;    // N/m; 0: it does not stretch
};

}  // namespace nbd
