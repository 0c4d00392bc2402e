#pragma once

#include <Eigen/Core>
#include <vector>

namespace nbd {

/// Bounds on the deformation gradients F of a region's tetrahedra in a pose: |F - G| <= deviation and
/// |F| <= stretch for each of them (spectral norms, so `stretch` bounds the largest singular value).
/// If only the stretch is known, use {.deviation = stretch, .stretch = stretch} and leave G zero.
struct RegionMotion {
    Eigen::Matrix3f G = Eigen::Matrix3f::Zero();
    float deviation = 0;
    float stretch = 0;
};

/// The tetrahedra of a body in groups that move nearly alike.
struct TetRegions {
    std::vector<int> of_tet;        // [T] the region of each tetrahedron
    std::vector<int> sample_begin;  // [regions + 1] into `samples`
    std::vector<int> samples;  // tetrahedra whose mean gradient is the region's G; at least one per region

    int count() const noexcept { return static_cast<int>(sample_begin.size()) - 1; }
};

}  // namespace nbd
