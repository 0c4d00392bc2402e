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

/// How much of each tetrahedron material fills, one row each: the means over its volume of the ten shape
/// functions of a quadratic one, in the order of T and E, counted where material is. They are >= 0 and sum to
/// the share that is filled; of a full one each is 1 / 10. [T, 10].
using TetFill = Eigen::Matrix<double, Eigen::Dynamic, 10, Eigen::RowMajor>;

/// Linear tetrahedra; or quadratic ones on Bezier control points, which are their nodes: the point of
/// barycentric coordinates z lies at sum z_a^2 x_a + sum 2 z_a z_b x_ab, over corners a and edges ab. All
/// these weights are >= 0 and sum to 1. At rest a node x_ab lies in the middle of its edge.
struct TetMesh {
    Nodes X;         // [N, 3]
    Tets T;          // [T, 4] corners
    TetEdges E{};    // [T, 6] of quadratic tetrahedra, [0, 6] of linear ones
    TetFill fill{};  // [T, 10]; [0, 10] if all are full

    bool is_quadratic() const noexcept { return E.rows() > 0; }
    /// The share of a tetrahedron that is filled.
    double filled(Eigen::Index t) const { return fill.rows() > 0 ? fill.row(t).sum() : 1; }
};

}  // namespace nbd
