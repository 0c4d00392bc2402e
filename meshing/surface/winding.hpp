#pragma once

#include <span>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// How often the surface winds around a point: near 1 or -1 within a closed one, near 0 outside. faces: those
/// of mesh.F that count. The point must not lie on them.
double winding_number(const TriMesh& mesh, std::span<const int> faces, const Eigen::RowVector3d& point);

/// Which part of a surface lies within another one that it does not meet.
enum class Containment { none, some_parts, whole };

/// Whether `inner` lies within `outer`, part by part (a part: faces connected by vertices). None if `outer`
/// has open edges or edges of more than two faces, as it has no inside. Surfaces that meet: not defined.
Containment containment(const TriMesh& inner, const TriMesh& outer);

}  // namespace nbd
