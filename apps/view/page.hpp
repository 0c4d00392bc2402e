#pragma once

#include <ostream>

#include "apps/view/view_scene.hpp"

namespace nbd {

/// Writes a page of HTML that shows the scene in a browser. It contains all that it needs and fetches
/// nothing. Positions are rounded to steps of 1/65535 of the box around all frames of their body. The same
/// scene gives the same bytes. Throws std::invalid_argument on a number that is not finite.
void write_page(std::ostream& out, const ViewScene& scene);

}  // namespace nbd
