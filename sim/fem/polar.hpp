#pragma once

#include <Eigen/Core>
#include <array>

namespace nbd {

/// Numbers of several matrices side by side, for vector units.
constexpr int lanes = 8;
using Lanes = Eigen::Array<double, lanes, 1>;

/// `lanes` 3x3 matrices; entry (i, j) of all of them stands together.
struct LaneMatrix3 {
    std::array<Lanes, 9> entries;
    Lanes& operator()(int i, int j) noexcept { return entries[static_cast<std::size_t>(3 * j + i)]; }
    const Lanes& operator()(int i, int j) const noexcept {
        return entries[static_cast<std::size_t>(3 * j + i)];
    }
    Eigen::Matrix3d lane(int l) const noexcept;
    void set_lane(int l, const Eigen::Matrix3d& A) noexcept;
};

/// The rotation R (det = +1) that maximises tr(R^T F) in each lane: the polar factor of F, also for inverted
/// and flat F, where the direction of least stretch is the one taken as mirrored. R^T F is symmetric. The
/// same R is returned for the same F up to rounding, without history. Not unique where the two smallest
/// signed singular values add up to zero; identity for a non-finite F.
void rotations_of(const LaneMatrix3& F, LaneMatrix3& R) noexcept;

/// That of a single matrix.
Eigen::Matrix3d rotation_of(const Eigen::Matrix3d& F) noexcept;

}  // namespace nbd
