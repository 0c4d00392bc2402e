#pragma once

#include <span>
#include <vector>

#include "collision/geometry.hpp"

namespace nbd {

/// A copy of a body in a pose, as its faces are read.
struct PosedFaces {
    const Faces* F = nullptr;
    const float* x = nullptr;  // [n, 3]

    Eigen::Map<const Eigen::Vector3f> corner(int f, int k) const noexcept {
        return Eigen::Map<const Eigen::Vector3f>(x + 3 * (*F)(f, k));
    }
    Triangle face(int f) const noexcept { return {corner(f, 0), corner(f, 1), corner(f, 2)}; }
};

/// Keeps those of the candidates that intersect, by the tests that PairQuery makes: every method of the
/// benchmark answers by the same ones.
void keep_intersecting(std::vector<FacePair>& candidates, const PosedFaces& a, const PosedFaces& b);

/// Likewise, and sorts them and drops repeats.
std::span<const FacePair> sorted_intersecting(std::vector<FacePair>& candidates, const PosedFaces& a,
                                              const PosedFaces& b);

}  // namespace nbd
