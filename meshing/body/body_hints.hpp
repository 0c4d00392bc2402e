#pragma once

#include <string>
#include <vector>

#include "meshing/body/body.hpp"

namespace nbd {

/// What may make a body's motion wrong: size_hint(), thin_hint(), locking_hint() and corners_hint(), those
/// that are not empty. One line each, about the body, as in "is 173 m long; ...".
std::vector<std::string> body_hints(const Body& body);

/// A line about a body whose longest side is below 2 mm or above 20 m after scaling, as if its file had
/// another unit than metres; else empty.
std::string size_hint(const Body& body, double scale = 1);

/// A line about a body that bends where it is one linear tetrahedron thick, which makes it far too stiff;
/// else empty.
std::string thin_hint(const TetMesh& tets);

/// A line about the greatest Poisson's ratio if it locks linear tetrahedra: above 0.45. Else empty.
std::string locking_hint(const TetMesh& tets, const Material& material,
                         const std::vector<MaterialRegion>& regions);

/// A line about a collision surface that has the corners of quadratic tetrahedra alone, between which their
/// faces bulge unseen; else empty.
std::string corners_hint(const Body& body);

}  // namespace nbd
