#pragma once

#include <Eigen/Core>
#include <array>

namespace nbd {

/// Number of matrices processed side by side, for vector units.
constexpr int lanes = 8;
using Lanes = Eigen::Array<double, lanes, 1>;

/// `lanes` 3x3 matrices. The entries (i, j) of all of them are stored together.
struct LaneMatrix3 {
    std::array<Lanes, 9> entries;
    Lanes& operator()(int i, int j) noexcept { return entries[3 * j + i]; }
    const Lanes& operator()(int i, int j) const noexcept { return entries[3 * j + i]; }
    Eigen::Matrix3d lane(int l) const noexcept;
    void set_lane(int l, const Eigen::Matrix3d& A) noexcept;
};

/// For each lane, the rotation R (det = +1) that maximises tr(R^T F): the polar factor of F. For inverted and
/// flat F the direction of least stretch is taken as mirrored. R^T F is symmetric. R depends only on F (up to
/// rounding), not on earlier calls. R is not unique if the two smallest signed singular values add up to
/// zero. A non-finite F gives the identity.
void rotations_of(const LaneMatrix3& F, LaneMatrix3& R) noexcept;

/// The same for a single matrix.
Eigen::Matrix3d rotation_of(const Eigen::Matrix3d& F) noexcept;

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
