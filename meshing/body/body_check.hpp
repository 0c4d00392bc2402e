#pragma once

#include "meshing/body/body.hpp"

namespace nbd {

/// Throws std::invalid_argument naming the first constant that is out of the range that Material states.
void check_material(const Material& material);

/// Throws std::invalid_argument naming the first thing that is wrong: an empty mesh, an index out of range,
/// a number that is not finite, a tetrahedron without positive volume, shapes that disagree, weights that do
/// not sum to 1 or do not give the surface, a material out of range, modes that do not fit the nodes.
void check_body(const Body& body);

}  // namespace nbd
