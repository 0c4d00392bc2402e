#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include "collision/geometry/geometry.hpp"
#include "collision/geometry/tet_mesh.hpp"

namespace nbd {

/// Weights from tet nodes to surface vertices, [n, N]: x_surface = W x_nodes; rows sum to 1.
using Embedding = Eigen::SparseMatrix<double, Eigen::RowMajor>;

struct TriMesh {
    Nodes X;  // [n, 3]
    Faces F;  // [m, 3]
};

/// Faces of exactly one tetrahedron, oriented outward, sorted by (tet, local face). [b, 3] indices into
/// tets.X.
Faces boundary_faces(const TetMesh& tets);

}  // namespace nbd
