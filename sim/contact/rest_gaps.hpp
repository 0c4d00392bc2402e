#pragma once

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Walls of one surface that face each other across a gap.
struct RestGaps {
    long pairs = 0;    // of faces
    double least = 0;  // distance of a pair, metres; 0 without pairs
};

/// Pairs of faces that face each other at rest nearer than `distance`, metres, and are farther apart along
/// the edges of the surface than three times that: walls of a slit, not the sides of a crease.
RestGaps rest_gaps(const TriMesh& surface, double distance);

}  // namespace nbd
