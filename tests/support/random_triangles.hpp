#pragma once

#include <random>

#include "collision/geometry/geometry.hpp"

namespace nbd {

/// Random triangles for tests, identical on every machine.
class RandomTriangles {
 public:
    explicit RandomTriangles(unsigned seed) : random_(seed) {}

    int integer(int low, int high) { return low + static_cast<int>(random_() % (high - low + 1)); }

    /// Uniform in [0, 1).
    float uniform() { return static_cast<float>(random_() >> 8) * 0x1p-24f; }

    /// Uniform in the unit cube.
    Eigen::Vector3f point();

    /// Integer coordinates from 0 to high, so degenerate, coplanar and touching triangles are common.
    Eigen::Vector3f grid_point(int high);

    /// Integer coordinates from -high to high.
    Eigen::Vector3f grid_step(int high);

    Triangle triangle();
    Triangle grid_triangle(int high);

    /// x, moved by up to `most` ulp along each axis.
    Eigen::Vector3f nudged(Eigen::Vector3f x, int most = 2);

    /// A triangle whose first corner (and sometimes an edge) lies within a few ulp of a corner, an edge or
    /// the face of s.
    Triangle nearly_touching(const Triangle& s);

 private:
    std::mt19937 random_;
};

}  // namespace nbd
