#pragma once

#include <Eigen/Core>
#include <vector>

#include "apps/bench/elements/quadratic_mesh.hpp"
#include "sim/factor/block_pattern.hpp"
#include "sim/materials/material_law.hpp"

namespace nbd {

/// What a tetrahedron of N nodes adds to the equations of small displacements, N = 4 or 10; its edges are
/// straight. Exact integrals: by one point, or by the four of the rule of degree 2.
template <int N>
struct ElementIntegrals {
    Eigen::Matrix<double, 3 * N, 3 * N> stiffness;  // N/m, x y z of node 0 first
    Eigen::Matrix<double, N, 1> shapes;             // of the shape functions, m3
};

/// corners: as columns, metres; positively oriented. Nodes are numbered as in Elements.
template <int N>
ElementIntegrals<N> integrate_element(const Eigen::Matrix<double, 3, 4>& corners, const Moduli& moduli);

/// A body of one material whose first tetrahedra are held: the equations K u = f of small displacements under
/// a force that is the same in each part of its volume. N: nodes of a tetrahedron, 4 or 10.
template <int N>
class ClampedBody {
 public:
    /// X: [nodes, 3], metres. T: indices into X. held: tetrahedra 0 .. held - 1 do not move. X and T must
    /// outlive the body.
    ClampedBody(const Nodes& X, const Elements<N>& T, int held);

    int unknown_count() const noexcept { return 3 * pattern_.node_count(); }
    SparseMatrix zero_matrix() const { return pattern_.zero_matrix(); }

    /// force: N/m3. K: from zero_matrix(). f: [unknowns].
    void assemble(const Moduli& moduli, const Eigen::Vector3d& force, SparseMatrix& K,
                  Eigen::VectorXd& f) const;

    /// Values of all nodes, zero where they are held. u: [unknowns].
    Nodes of_nodes(const Eigen::VectorXd& u) const;

 private:
    const Nodes& X_;
    const Elements<N>& T_;
    int held_;
    std::vector<int> row_;  // [nodes] number among the nodes that move; -1: held
    BlockPattern pattern_;  // of these
};

}  // namespace nbd
