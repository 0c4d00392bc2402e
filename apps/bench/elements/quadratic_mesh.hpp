#pragma once

#include "collision/geometry/tet_mesh.hpp"

namespace nbd {

/// Tetrahedra of N nodes, one row each: the four corners as in Tets and, of ten nodes, the midpoints of the
/// edges 01 02 03 12 13 23. [T, N].
template <int N>
using Elements = Eigen::Matrix<int, Eigen::Dynamic, N, Eigen::RowMajor>;

/// Tetrahedra with straight edges and a node in the middle of each.
struct QuadraticMesh {
    Nodes X;         // [N, 3]
    Elements<10> T;  // [T, 10]
};

/// Adds the midpoints; nodes and tetrahedra of the mesh keep their numbers.
QuadraticMesh add_midpoints(const TetMesh& mesh);

/// Splits every tetrahedron into eight on the same nodes: tetrahedron t becomes 8 t to 8 t + 7. The
/// octahedron that is left between the corners is cut along its shortest diagonal.
TetMesh split(const QuadraticMesh& mesh);

}  // namespace nbd
