#pragma once

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Covers a closed surface anew with triangles whose edges are about `edge` metres long [BotschKobbelt04].
/// Edges at which faces turn by more than 50 degrees stay, divided likewise. All vertices then move along
/// their normals by one distance, so that the new surface has the volume of the old one: none where it is
/// flat. Shells are covered one by one; a cavity that is too small for such edges keeps its own triangles.
/// The same input gives the same bits. surface: from make_solid_boundary(). Throws
/// std::invalid_argument for an edge that is not finite and more than 0, or so long that no closed surface is
/// left; whether the new surface intersects itself is for make_solid_boundary() to tell.
TriMesh remesh(const TriMesh& surface, double edge);

/// The volume that a closed surface bounds, m3.
double enclosed_volume(const TriMesh& surface);

/// Number of triangles that remesh() makes, about.
double remeshed_faces(const TriMesh& surface, double edge);

}  // namespace nbd
