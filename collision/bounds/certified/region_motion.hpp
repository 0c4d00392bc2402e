#pragma once

#include <Eigen/Core>
#include <vector>

namespace nbd {

/// What is known in a pose of the deformation gradients F of a region's tetrahedra: |F - G| <= deviation and
/// |F| <= stretch for every one of them (spectral norms, so `stretch` bounds the largest singular value).
/// Who knows of the stretch alone gives {.deviation = stretch, .stretch = stretch}, and G stays zero.
struct RegionMotion {
    Eigen::Matrix3f G = Eigen::Matrix3f::Zero();
    float deviation = 0;
    float stretch = 0;
};

/// The tetrahedra of a body in groups, each of which moves about alike.
struct TetRegions {
    std::vector<int> of_tet;        // [T] the region of each tetrahedron
    std::vector<int> sample_begin;  // [regions + 1] into `samples`
    std::vector<int> samples;  // tetrahedra whose mean gradient is their region's G; at least one a region

    int count() const noexcept { return static_cast<int>(sample_begin.size()) - 1; }
};

}  // namespace nbd
