#pragma once

#include <array>

#include "collision/geometry/box.hpp"
#include "collision/geometry/geometry.hpp"
#include "collision/geometry/positions.hpp"

namespace nbd {

/// Corners of a face, one per column: a register each.
using FaceCorners = std::array<Eigen::Array4f, 3>;

/// Faces in a pose, in the form that triangle tests read.
struct PosedFaces {
    const Faces* F = nullptr;
    Positions x;  // require() was called for the vertices of the faces to be read

    /// Lane 3 is unspecified, see Positions::operator[].
    Eigen::Array4f corner(int face, int k) const noexcept { return x[(*F)(face, k)]; }
    FaceCorners corners(int face) const noexcept {
        return {corner(face, 0), corner(face, 1), corner(face, 2)};
    }
    /// Lane 3 of both corners is unspecified.
    Box box(int face) const noexcept {
        const Eigen::Array4f a = corner(face, 0), b = corner(face, 1), c = corner(face, 2);
        return {a.min(b).min(c), a.max(b).max(c)};
    }
    Triangle triangle(int face) const noexcept {
        return {x.point((*F)(face, 0)), x.point((*F)(face, 1)), x.point((*F)(face, 2))};
    }
};

}  // namespace nbd
