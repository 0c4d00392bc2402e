#pragma once

#include "meshing/body/body.hpp"

namespace nbd {

/// Throws std::invalid_argument naming the first error: an empty mesh, an index out of range, a non-finite
/// number, a tetrahedron without positive volume, inconsistent shapes, weights that do not sum to 1 or do not
/// reproduce the surface, a material or region out of range, or modes that do not fit the nodes.
void check_body(const Body& body);

}  // namespace nbd
