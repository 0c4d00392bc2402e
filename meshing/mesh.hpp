#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include "collision/geometry.hpp"

namespace nbd {

/// Node positions in double precision, one row a node, metres. [N, 3], row-major.
using Nodes = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
using NodesRef = Eigen::Ref<const Nodes>;

/// Tetrahedra, one row each, positively oriented: det[b - a, c - a, d - a] > 0. [T, 4].
using Tets = Eigen::Matrix<int, Eigen::Dynamic, 4, Eigen::RowMajor>;

/// Weights that carry tet nodes to surface vertices: x_surface = W x_nodes, rows sum to 1. [n, N].
using Embedding = Eigen::SparseMatrix<double, Eigen::RowMajor>;

struct TriMesh {
    Nodes X;  // [n, 3]
    Faces F;  // [m, 3]
};

struct TetMesh {
    Nodes X;  // [N, 3]
    Tets T;   // [T, 4]
};

/// Faces that belong to one tetrahedron only, oriented outward, indices into tets.X, sorted by (tet, local
/// face). [b, 3].
Faces boundary_faces(const TetMesh& tets);

}  // namespace nbd
