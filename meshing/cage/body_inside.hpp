#pragma once

#include <string>

#include "meshing/body/body.hpp"

namespace nbd {

/// Makes a body of a surface that lies inside the tetrahedra of another body: the new one has the same
/// tetrahedra and material. surface: after clean_soup(). All weights are >= 0. The body has no modes yet.
/// Throws std::invalid_argument if a vertex lies outside the tetrahedra.
Body make_body_inside(std::string name, TriMesh surface, const Body& outer);

}  // namespace nbd
