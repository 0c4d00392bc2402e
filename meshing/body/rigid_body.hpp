#pragma once

#include <string>

#include "meshing/body/body.hpp"

namespace nbd {

/// An acceleration, m/s2, that a rigid body hardly feels: loads of this size strain it by a ten-thousandth.
constexpr double rigid_acceleration = 1e4, rigid_strain = 1e-4;

/// Makes a rigid body: its surface hangs on the four nodes of one linear tetrahedron around it, with weights
/// >= 0, whose fill has the volume, the centre and the moments of inertia of what the surface encloses, and
/// which is as stiff as rigid_young() says. So it is an affine body [LanKaufmanLiJiangYang22], and all that
/// bodies do holds for it. surface: closed, faces outward, cavities into their hollow, as
/// make_solid_boundary() leaves it. Throws std::invalid_argument for a density out of range and a surface
/// without volume.
Body make_rigid_body(std::string name, TriMesh surface, double density);

/// Whether a mesh is that of a rigid body: one linear tetrahedron with a fill.
bool is_rigid(const TetMesh& tets) noexcept;

/// The material of a rigid body, whose size is that of its tetrahedron. density: kg/m3.
Material rigid_material(const TetMesh& tets, double density);

}  // namespace nbd
