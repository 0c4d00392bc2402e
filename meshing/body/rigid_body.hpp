#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "meshing/body/body.hpp"

namespace nbd {

/// An acceleration, m/s2, that a rigid body hardly feels: loads of this size strain it by a ten-thousandth.
constexpr double rigid_acceleration = 1e4, rigid_strain = 1e-4;

/// Mass and moments of inertia of a rigid body, in place of what a density makes of its surface.
struct RigidInertia {
    double mass = 0;  // kg, > 0
    // Of mass, metres, where the body is; none: of what the surface encloses.
    std::optional<Eigen::Vector3d> centre{};
    // The tensor about the centre, along the body's axes, kg m2; none: as if the mass were spread evenly.
    std::optional<Eigen::Matrix3d> moments{};

    bool operator==(const RigidInertia&) const = default;
};

/// Makes a rigid body: its surface hangs on the four nodes of one linear tetrahedron around it, with weights
/// >= 0, whose fill has the volume, the centre and the moments of inertia of what the surface encloses, and
/// which is as stiff as rigid_young() says. So it is an affine body [LanKaufmanLiJiangYang22], and all that
/// bodies do holds for it. surface: closed, faces outward, cavities into their hollow, as
/// make_solid_boundary() leaves it. Throws std::invalid_argument for a density out of range and a surface
/// without volume.
Body make_rigid_body(std::string name, TriMesh surface, double density);

/// Likewise, with an inertia of its own, whose centre is in the coordinates of the surface. Throws
/// std::invalid_argument as set_inertia(), too.
Body make_rigid_body(std::string name, TriMesh surface, RigidInertia inertia);

/// Whether a mesh is that of a rigid body: one linear tetrahedron with a fill.
bool is_rigid(const TetMesh& tets) noexcept;

/// Changes the fill of the tetrahedron of a rigid body, and returns the density, kg/m3, with which it has
/// this inertia. tets: in the coordinates of the centre, at the size that the body has. Throws
/// std::invalid_argument where no mass has such moments, or only one that reaches out of the tetrahedron.
double set_inertia(TetMesh& tets, const RigidInertia& inertia);

/// The material of a rigid body, whose size is that of its tetrahedron. density: kg/m3.
Material rigid_material(const TetMesh& tets, double density);

}  // namespace nbd
