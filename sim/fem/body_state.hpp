#pragma once

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Positions and velocities of a body's nodes, both [N, 3], m and m/s.
struct BodyState {
    Nodes x, v;
};

}  // namespace nbd
