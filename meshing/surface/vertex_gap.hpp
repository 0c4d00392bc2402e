#pragma once

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// The largest distance of a point of a face from the nearest vertex of the face, metres; 0 without faces. A
/// ball of at least this radius whose centre passes through a face holds one of its vertices on the way.
/// In a face without an obtuse angle it is the radius of the circle around it: half the longest edge with a
/// right angle, and the longest edge divided by sqrt(3), the most of all shapes, if all edges are equal.
double vertex_gap(const TriMesh& mesh);

}  // namespace nbd
