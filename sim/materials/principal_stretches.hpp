#pragma once

#include <array>

#include "sim/materials/polar.hpp"

namespace nbd {

/// Three numbers for each lane, one per principal axis.
using PrincipalLanes = std::array<Lanes, 3>;

/// The signed singular value decomposition F = U diag(sigma) V^T of `lanes` matrices: U and V are rotations,
/// and where det F < 0 the sigma of least magnitude is negative [IrvingTF04].
struct PrincipalStretches {
    LaneMatrix3 U, V;
    PrincipalLanes sigma;
};

/// R: the rotations of F, from rotations_of(). Entries that are not finite stay so in sigma.
PrincipalStretches principal_stretches(const LaneMatrix3& F, const LaneMatrix3& R) noexcept;

/// A symmetric 3x3 matrix for each lane: `diagonal[i]` is entry (i, i), `off[i]` is the one off the diagonal
/// that is in neither row nor column i.
struct SymmetricLanes {
    PrincipalLanes diagonal, off;
};

/// Turns A into the diagonal matrix of its eigenvalues, in no order, and returns the eigenvectors as columns
/// of rotations.
LaneMatrix3 diagonalise(SymmetricLanes& A) noexcept;

/// Replaces the negative eigenvalues of A by zero.
void clamp_eigenvalues(SymmetricLanes& A) noexcept;

}  // namespace nbd
