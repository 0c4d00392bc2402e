#pragma once

#include <optional>
#include <string>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Which part of a surface lies within another one that it does not meet.
enum class Containment { none, some_parts, whole };

/// Whether `inner` lies within the solid that `outer` bounds, part by part (a part: faces connected by
/// vertices). None if `outer` has open edges, edges of more than two faces or one side, as it has no inside.
/// The faces of `outer` may look either way. Surfaces that meet: not defined.
Containment containment(const TriMesh& inner, const TriMesh& outer);

/// Deviations to allow from one closed shell, with or without cavities, free of self-intersections.
struct SolidBoundaryConfig {
    bool allow_components = false;  // allow several shells, side by side or in each other's cavities
    bool allow_self_intersection = false;
};

/// Properties of a surface and the repairs made to it.
struct SurfaceReport {
    int vertices = 0, edges = 0, faces = 0;
    int dropped_vertices = 0;  // vertices that no face uses
    int turned_faces = 0;      // faces whose orientation was changed
    int shells = 0;            // components that bound material from outside
    int cavities = 0;          // components inside a shell that bound a hollow
    int genus = 0;             // sum over the components
    int intersecting_pairs = 0;
    std::optional<FacePair> first_intersection;
    double area = 0;    // m2
    double volume = 0;  // m3, cavities subtracted
};

/// One line: counts, area and volume, then repairs and allowed deviations.
std::string describe(const SurfaceReport& report);

struct SolidBoundary {
    TriMesh mesh;
    SurfaceReport report;
};

/// Makes the surface the boundary of a solid. Drops unreferenced vertices (the others keep their order).
/// Keeps the order of faces and turns them where needed: shells outward, cavities into their hollow. A
/// component inside an odd number of others is a cavity. Throws std::invalid_argument as check_surface()
/// does, for a one-sided surface or a component without volume, and, unless allowed, for self-intersection
/// (naming the first pair of faces) or several shells.
SolidBoundary make_solid_boundary(TriMesh mesh, const SolidBoundaryConfig& config = {});

/// Makes the faces of a closed surface agree and turns its parts outward: those in a hollow of others into
/// it. Returns how many faces it turned. Leaves a surface alone that has open edges or edges of more than two
/// faces. Throws std::invalid_argument naming two faces if the surface is one-sided. mesh: finite, indices in
/// range.
int turn_outward(TriMesh& mesh);

}  // namespace nbd
