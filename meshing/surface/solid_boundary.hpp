#pragma once

#include <optional>
#include <string>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// What else than one closed shell free of self-intersections is let through.
struct SolidBoundaryConfig {
    bool allow_components = false;  // several shells, and cavities in them
    bool allow_self_intersection = false;
};

/// What a surface is and what was done to it.
struct SurfaceReport {
    int vertices = 0, edges = 0, faces = 0;
    int dropped_vertices = 0;  // no face used them
    int turned_faces = 0;      // orientation changed
    int shells = 0;            // components that bound material from outside
    int cavities = 0;          // components inside a shell, bounding a hollow of it
    int genus = 0;             // sum over the components
    int intersecting_pairs = 0;
    std::optional<FacePair> first_intersection;
    double area = 0;    // m2
    double volume = 0;  // m3, cavities subtracted
};

/// One line: the counts, area and volume, then what was repaired and what was let through.
std::string describe(const SurfaceReport& report);

struct SolidBoundary {
    TriMesh mesh;
    SurfaceReport report;
};

/// The surface as the boundary of a solid: unreferenced vertices dropped (the others keep their order),
/// faces in their order and, where needed, turned so that shells are oriented outward and cavities into
/// their hollow. A component inside an odd number of others is a cavity.
/// Throws std::invalid_argument as check_surface() does, and on a one-sided surface, a component without
/// volume, and, unless allowed, self-intersection (naming the first pair of faces) or several components.
SolidBoundary make_solid_boundary(TriMesh mesh, const SolidBoundaryConfig& config = {});

}  // namespace nbd
