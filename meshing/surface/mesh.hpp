#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include "collision/geometry/geometry.hpp"
#include "collision/geometry/tet_mesh.hpp"

namespace nbd {

/// Weights that carry tet nodes to surface vertices: x_surface = W x_nodes, rows sum to 1. [n, N].
using Embedding = Eigen::SparseMatrix<double, Eigen::RowMajor>;

struct TriMesh {
    Nodes X;  // [n, 3]
    Faces F;  // [m, 3]
};

/// Faces that belong to one tetrahedron only, oriented outward, indices into tets.X, sorted by (tet, local
/// face). [b, 3].
Faces boundary_faces(const TetMesh& tets);

}  // namespace nbd
