#pragma once

#include <Eigen/Core>

namespace nbd {

/// Node positions in double precision, one row per node, metres. [N, 3], row-major.
using Nodes = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
using NodesRef = Eigen::Ref<const Nodes>;

/// Tetrahedra, one row each, positively oriented: det[b - a, c - a, d - a] > 0. [T, 4].
using Tets = Eigen::Matrix<int, Eigen::Dynamic, 4, Eigen::RowMajor>;

struct TetMesh {
    Nodes X;  // [N, 3]
    Tets T;   // [T, 4]
};

}  // namespace nbd
