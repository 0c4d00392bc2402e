#pragma once

#include <cmath>
#include <random>
#include <utility>

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
    Eigen::Vector3f point() {
        const float x = uniform(), y = uniform();
        return {x, y, uniform()};
    }

    /// Integer coordinates from 0 to high, so degenerate, coplanar and touching triangles are common.
    Eigen::Vector3f grid_point(int high) {
        const int x = integer(0, high), y = integer(0, high);
        return Eigen::Vector3f(x, y, integer(0, high));
    }

    /// Integer coordinates from -high to high.
    Eigen::Vector3f grid_step(int high) {
        return grid_point(2 * high) - Eigen::Vector3f::Constant(static_cast<float>(high));
    }

    Triangle triangle() {
        const Eigen::Vector3f a = point(), b = point();
        return {a, b, point()};
    }

    Triangle grid_triangle(int high) {
        const Eigen::Vector3f a = grid_point(high), b = grid_point(high);
        return {a, b, grid_point(high)};
    }

    /// x, moved by up to `most` ulp along each axis.
    Eigen::Vector3f nudged(Eigen::Vector3f x, int most = 2) {
        for (int i = 0; i < 3; ++i)
            for (int k = integer(0, most); k > 0; --k)
                x[i] = std::nextafter(x[i], integer(0, 1) ? HUGE_VALF : -HUGE_VALF);
        return x;
    }

    /// A triangle whose first corner (and sometimes an edge) lies within a few ulp of a corner, an edge or
    /// the face of s.
    Triangle nearly_touching(const Triangle& s) {
        const auto near = [&] {
            const float u = integer(0, 3) ? uniform() : 0, v = integer(0, 2) ? uniform() : 1;
            return nudged(s.a + u * (s.b - s.a) + (1 - u) * v * (s.c - s.a));
        };
        const Eigen::Vector3f a = near(), b = integer(0, 2) ? point() : near();
        return {a, b, point()};
    }

 private:
    std::mt19937 random_;
};

}  // namespace nbd
