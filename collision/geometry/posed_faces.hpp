#pragma once

#include <array>

#include "collision/geometry/box.hpp"
#include "collision/geometry/geometry.hpp"
#include "collision/geometry/vertex_view.hpp"

namespace nbd {

/// Where the corners of a face stand: four numbers each, of which the last one is unspecified.
using FaceCorners = std::array<const float*, 3>;

/// Faces in a pose, in the form that triangle tests read.
struct PosedFaces {
    const Faces* F = nullptr;
    VertexView x;

    /// Lane 3 is unspecified, see VertexView::operator[].
    Eigen::Array4f corner(int face, int k) const noexcept { return x[(*F)(face, k)]; }
    /// spare: takes a corner that no number may follow.
    FaceCorners corners(int face, Eigen::Array4f& spare) const noexcept {
        return {x.four((*F)(face, 0), spare), x.four((*F)(face, 1), spare), x.four((*F)(face, 2), spare)};
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
