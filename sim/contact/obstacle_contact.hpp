#pragma once

#include <vector>

#include "sim/contact/contact.hpp"
#include "sim/obstacles/obstacle.hpp"
#include "sim/patches/contact_surface.hpp"

namespace nbd {

/// Appends contacts for a step that starts at `time`, for vertices of a body at most `reach` metres outside
/// an obstacle, by ascending vertex. Stiffness stays zero.
void find_obstacle_contacts(int body, const ContactSurface& surface, const Obstacle& obstacle, double time,
                            double dt, double reach, std::vector<Contact>& contacts);

}  // namespace nbd
