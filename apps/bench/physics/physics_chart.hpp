#pragma once

#include <vector>

#include "apps/bench/physics/physics_run.hpp"
#include "apps/drawing/canvas.hpp"

namespace nbd {

/// A row of cells for each check: by mode, size and step, coloured by the largest error there over what is
/// allowed.
Page physics_page(std::vector<PhysicsResult> results);

}  // namespace nbd
