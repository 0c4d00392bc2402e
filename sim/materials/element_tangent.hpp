#pragma once

#include <Eigen/Core>
#include <array>

#include "sim/materials/material_law.hpp"

namespace nbd {

/// The derivative of the stress P of `lanes` elements, in the principal axes of their deformation gradients.
struct ElementTangent {
    LaneMatrix3 U, V;
    SymmetricLanes A;
    PrincipalLanes same, crossed;  // dP_ij = same_k H_ij + crossed_k H_ji for the third axis k

    ElementTangent() = default;  // uninitialised
    /// weight: of each element, for example its volume.
    ElementTangent(const PrincipalStretches& stretches, const PrincipalResponse& response,
                   const Lanes& weight) noexcept;

    /// The change of P, times the weight, where F changes by H.
    LaneMatrix3 multiply(const LaneMatrix3& H) const noexcept;
};

/// The blocks (a, b), a < b, of the stiffness matrix of a tetrahedron of four nodes: (0, 1), (0, 2), (0, 3),
/// (1, 2), (1, 3), (2, 3). The blocks (b, a) are their transposes.
using TetBlocks = std::array<Eigen::Matrix3f, 6>;
/// Likewise of ten nodes.
using QuadraticTetBlocks = std::array<Eigen::Matrix3f, 45>;

/// The place of nodes a < b among the pairs of a tetrahedron of so many nodes.
template <int nodes>
constexpr int pair_of_nodes(int a, int b) noexcept {
    return a * (2 * nodes - 1 - a) / 2 + b - a - 1;
}

/// These blocks of `lanes` elements.
using LaneBlocks = std::array<LaneMatrix3, 6>;

/// Sets the blocks of a tangent. gradient: of shape functions 1 to 3, as columns.
void stiffness_blocks(const ElementTangent& tangent, const LaneMatrix3& gradient,
                      LaneBlocks& blocks) noexcept;

/// A quadratic form in velocities that vanishes for rotations: mu |E|^2 + lambda/2 (tr E)^2, where
/// E = sym(F^T grad v). With a rotation as F it is the corotated energy; with a deformation gradient, E is
/// the rate of Green's strain. lambda, mu: times the volume.
struct StrainForm {
    const LaneMatrix3& F;
    Lanes lambda, mu;

    /// The derivative by H = grad v.
    LaneMatrix3 multiply(const LaneMatrix3& H) const noexcept;
    /// Adds its second derivatives. gradient: of shape functions 1 to 3, as columns.
    void add_blocks(const LaneMatrix3& gradient, LaneBlocks& blocks) const noexcept;
};

/// Stores the blocks of the first `count` elements.
void store_blocks(const LaneBlocks& from, int count, TetBlocks* to) noexcept;

}  // namespace nbd
