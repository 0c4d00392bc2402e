#pragma once

#include "collision/geometry.hpp"
#include "collision/positions.hpp"

namespace nbd {

/// Faces in a pose, as triangle tests read them.
struct PosedFaces {
    const Faces* F = nullptr;
    Positions x;  // whose vertices of the faces have been required

    /// See Positions::operator[] for what the fourth number is.
    Eigen::Array4f corner(int face, int k) const noexcept { return x[(*F)(face, k)]; }
    Triangle triangle(int face) const noexcept {
        return {x.point((*F)(face, 0)), x.point((*F)(face, 1)), x.point((*F)(face, 2))};
    }
};

}  // namespace nbd
