#pragma once

#include <array>
#include <vector>

#include "meshing/surface/mesh.hpp"

namespace nbd::test {

/// Rounds positions to float32, as a surface file does.
TriMesh as_from_file(TriMesh mesh);

/// Joins two surfaces without welding.
TriMesh joined(const TriMesh& a, const TriMesh& b);

TriMesh moved(TriMesh mesh, double x, double y, double z, double scale = 1);

/// A tetrahedron: four faces, six edges.
TriMesh tetrahedron();

/// A unit sphere with 20 * 4^level faces.
TriMesh icosphere(int level);

/// A torus around the z axis with 2 nu nv faces.
TriMesh torus(double R, double r, int nu, int nv);

/// An axis-aligned box with one corner at the origin and n x n squares on each side: 12 n^2 faces.
TriMesh box(double x, double y, double z, int n);

/// Faces in ascending order, each from its smallest vertex on: equal for surfaces that differ in the order of
/// their faces alone.
std::vector<std::array<int, 3>> sorted_faces(const Faces& F);

}  // namespace nbd::test
