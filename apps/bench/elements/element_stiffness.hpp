#pragma once

#include <Eigen/Core>

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

}  // namespace nbd
