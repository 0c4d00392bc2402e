#pragma once

#include <Eigen/Core>

namespace nbd {

/// Node positions in double precision, one row per node, metres. [N, 3], row-major.
using Nodes = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
using NodesRef = Eigen::Ref<const Nodes>;

/// Tetrahedra, one row each, positively oriented: det[b - a, c - a, d - a] > 0. [T, 4].
using Tets = Eigen::Matrix<int, Eigen::Dynamic, 4, Eigen::RowMajor>;

/// The nodes of the edges 01 02 03 12 13 23 of tetrahedra, one row each. [T, 6].
using TetEdges = Eigen::Matrix<int, Eigen::Dynamic, 6, Eigen::RowMajor>;

/// The nodes of elements, one row each.
using ElementNodes = Eigen::Matrix<int, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Linear tetrahedra; or quadratic ones on Bezier control points, which are their nodes: the point of
/// barycentric coordinates z lies at sum z_a^2 x_a + sum 2 z_a z_b x_ab, over corners a and edges ab. All
/// these weights are >= 0 and sum to 1. At rest a node x_ab lies in the middle of its edge.
struct TetMesh {
    Nodes X;       // [N, 3]
    Tets T;        // [T, 4] corners
    TetEdges E{};  // [T, 6] of quadratic tetrahedra, [0, 6] of linear ones

    bool is_quadratic() const noexcept { return E.rows() > 0; }
};

}  // namespace nbd
