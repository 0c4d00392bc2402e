#include "tests/support/random_triangles.hpp"

#include <cmath>

namespace nbd {

Eigen::Vector3f RandomTriangles::point() {
    const float x = uniform(), y = uniform();
    return {x, y, uniform()};
}

Eigen::Vector3f RandomTriangles::grid_point(int high) {
    const int x = integer(0, high), y = integer(0, high);
    return Eigen::Vector3f(x, y, integer(0, high));
}

Eigen::Vector3f RandomTriangles::grid_step(int high) {
    return grid_point(2 * high) - Eigen::Vector3f::Constant(static_cast<float>(high));
}

Triangle RandomTriangles::triangle() {
    const Eigen::Vector3f a = point(), b = point();
    return {a, b, point()};
}

Triangle RandomTriangles::grid_triangle(int high) {
    const Eigen::Vector3f a = grid_point(high), b = grid_point(high);
    return {a, b, grid_point(high)};
}

Eigen::Vector3f RandomTriangles::nudged(Eigen::Vector3f x, int most) {
    for (int i = 0; i < 3; ++i)
        for (int k = integer(0, most); k > 0; --k)
            x[i] = std::nextafter(x[i], integer(0, 1) ? HUGE_VALF : -HUGE_VALF);
    return x;
}

Triangle RandomTriangles::nearly_touching(const Triangle& s) {
    const auto near = [&] {
        const float u = integer(0, 3) ? uniform() : 0, v = integer(0, 2) ? uniform() : 1;
        return nudged(s.a + u * (s.b - s.a) + (1 - u) * v * (s.c - s.a));
    };
    const Eigen::Vector3f a = near(), b = integer(0, 2) ? point() : near();
    return {a, b, point()};
}

}  // namespace nbd
