#pragma once

#include <Eigen/Core>
#include <compare>

namespace nbd {

/// Vertex positions, one row per vertex, metres. [n, 3], row-major, so a flat x y z array maps onto it.
using Vertices = Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>;
using VerticesRef = Eigen::Ref<const Vertices>;

/// Triangles, one row per face: three vertex indices, counter-clockwise seen from outside. [m, 3].
using Faces = Eigen::Matrix<int, Eigen::Dynamic, 3, Eigen::RowMajor>;
using FacesRef = Eigen::Ref<const Faces>;

struct Triangle {
    Eigen::Vector3f a, b, c;
};

/// All points within `r` of `c`, metres.
struct Sphere {
    Eigen::Vector3f c = Eigen::Vector3f::Zero();
    float r = 0;
};

/// Two triangles that may touch: rows of the two face arrays.
struct FacePair {
    int a = 0, b = 0;
    auto operator<=>(const FacePair&) const = default;
};

}  // namespace nbd
