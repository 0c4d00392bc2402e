#pragma once

#include <string>

#include "meshing/body/body.hpp"
#include "meshing/surface/subdivide.hpp"

namespace nbd {

/// The boundary of a tetrahedral mesh as a separate surface: vertices in node order, faces in the order of
/// boundary_faces().
TriMesh boundary_surface(const TetMesh& tets);

/// Makes a body. Its collision surface is `surface` subdivided `levels` times and embedded in the tetrahedra;
/// its faces keep their order (see subdivide()). The body has no modes yet.
/// surface: closed, in or near the tetrahedra, such as the input of tetrahedralize(). levels: 0 to 4.
/// Throws std::invalid_argument for a material out of range, a surface that check_surface() rejects or that
/// lies too far outside the tetrahedra (see embed()), and other levels.
Body make_body(std::string name, const TriMesh& surface, TetMesh tets, const Material& material = {},
               int levels = 0, SubdivisionScheme scheme = SubdivisionScheme::midpoint);

/// Makes a body with the boundary of the tetrahedra as its surface.
Body make_body(std::string name, TetMesh tets, const Material& material = {}, int levels = 0,
               SubdivisionScheme scheme = SubdivisionScheme::midpoint);

/// Makes a body of a surface that lies inside the tetrahedra of another body: the new one has the same
/// tetrahedra and material. surface: after clean_soup(). All weights are >= 0. The body has no modes yet.
/// Throws std::invalid_argument if a vertex lies outside the tetrahedra.
Body make_body_inside(std::string name, TriMesh surface, const Body& outer);

}  // namespace nbd
