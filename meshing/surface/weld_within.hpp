#pragma once

#include <string>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// What weld_within() did.
struct WeldReport {
    double length = 0;        // metres, as given
    int merged_vertices = 0;  // vertices that became one with another
    int dropped_faces = 0;    // faces that collapsed
    int split_edges = 0;      // open edges that were divided at a vertex on them
};

/// One line.
std::string describe(const WeldReport& report);

/// Closes cracks and T-junctions: merges vertices at most `length` apart, drops the faces that collapse, and
/// divides open edges at the open vertices that lie at most `length` beside them. A vertex moves to the first
/// vertex of the mesh within `length`, by at most that much. Everything else keeps its order and its bits.
/// Throws std::invalid_argument unless length is positive and finite. mesh: finite, indices in range.
TriMesh weld_within(const TriMesh& mesh, double length, WeldReport& report);

}  // namespace nbd
