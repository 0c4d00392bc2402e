#pragma once

#include <string>

#include "meshing/body/body.hpp"
#include "meshing/surface/subdivide.hpp"

namespace nbd {

/// The boundary of a tetrahedral mesh as a surface of its own: vertices in the order of the nodes, faces in
/// the order of boundary_faces().
TriMesh boundary_surface(const TetMesh& tets);

/// Puts a body together: the collision surface is `surface` subdivided `levels` times and moved by the
/// tetrahedra. Its faces keep their order (see subdivide()). No modes yet.
/// surface: closed, in or near the tetrahedra, such as the one that tetrahedralize() filled. levels: 0 to 4.
/// Throws std::invalid_argument on a material out of range, a surface that check_surface() refuses or that
/// lies too far outside the tetrahedra (see embed()), and other levels.
Body make_body(std::string name, const TriMesh& surface, TetMesh tets, const Material& material = {},
               int levels = 0, SubdivisionScheme scheme = SubdivisionScheme::midpoint);

/// The same with the tetrahedra's own boundary as the surface.
Body make_body(std::string name, TetMesh tets, const Material& material = {}, int levels = 0,
               SubdivisionScheme scheme = SubdivisionScheme::midpoint);

}  // namespace nbd
