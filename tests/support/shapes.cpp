#include "tests/support/shapes.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace nbd::shapes {
namespace {

/// A tube of `rows` rings, closed by a point at each end. radius(t) and height(t) take t in [0, 1] from
/// bottom to top.
template <class Radius, class Height>
Surface capped_tube(int rows, int columns, Radius radius, Height height) {
    Surface s{Vertices(rows * columns + 2, 3), Faces(2 * rows * columns, 3)};
    const int bottom = rows * columns, top = bottom + 1;
    s.X.row(bottom) << 0, 0, height(0.f);
    s.X.row(top) << 0, 0, height(1.f);
    int f = 0;
    for (int i = 0; i < rows; ++i)
        for (int j = 0; j < columns; ++j) {
            const float t = static_cast<float>(i + 1) / static_cast<float>(rows + 1);
            const float v =
                2 * std::numbers::pi_v<float> * static_cast<float>(j) / static_cast<float>(columns);
            s.X.row(i * columns + j) << radius(t) * std::cos(v), radius(t) * std::sin(v), height(t);
            const int a = i * columns + j, b = i * columns + (j + 1) % columns;
            if (i == 0) s.F.row(f++) << bottom, b, a;
            if (i == rows - 1) s.F.row(f++) << top, a, b;
            if (i == rows - 1) continue;
            s.F.row(f++) << a, b, b + columns;
            s.F.row(f++) << a, b + columns, a + columns;
        }
    return s;
}

}  // namespace

Surface torus(int rows, int columns, float major, float minor) {
    Surface s{Vertices(rows * columns, 3), Faces(2 * rows * columns, 3)};
    for (int i = 0; i < rows; ++i)
        for (int j = 0; j < columns; ++j) {
            const float u = 2 * std::numbers::pi_v<float> * static_cast<float>(i) / static_cast<float>(rows);
            const float v =
                2 * std::numbers::pi_v<float> * static_cast<float>(j) / static_cast<float>(columns);
            const float ring = major + minor * std::cos(v);
            s.X.row(i * columns + j) << ring * std::cos(u), ring * std::sin(u), minor * std::sin(v);
            const int a = i * columns + j, b = (i + 1) % rows * columns + j;
            const int c = (i + 1) % rows * columns + (j + 1) % columns, d = i * columns + (j + 1) % columns;
            const int f = 2 * (i * columns + j);
            s.F.row(f) << a, b, c;
            s.F.row(f + 1) << a, c, d;
        }
    return s;
}

Surface sphere(int rows, int columns, float r) {
    constexpr float pi = std::numbers::pi_v<float>;
    return capped_tube(
        rows, columns, [=](float t) { return r * std::sin(pi * t); },
        [=](float t) { return -r * std::cos(pi * t); });
}

Surface bar(int rows, int columns, float length, float r) {
    return capped_tube(
        rows, columns, [=](float) { return r; }, [=](float t) { return length * (t - 0.5f); });
}

float uniform(std::mt19937& random) {
    return static_cast<float>(random()) / static_cast<float>(std::mt19937::max()) * 2 - 1;
}

Eigen::Vector3f uniform3(std::mt19937& random) {
    const float a = uniform(random), b = uniform(random), c = uniform(random);
    return {a, b, c};
}

RigidTransform random_motion(std::mt19937& random, float reach) {
    Eigen::Vector4f q(uniform(random), uniform(random), uniform(random), uniform(random));
    const Eigen::Quaternionf turn(q[0], q[1], q[2], q[3]);
    return {turn.normalized().toRotationMatrix(), reach * uniform3(random)};
}

Vertices moved(const Vertices& X, const RigidTransform& motion) {
    return (X * motion.R.transpose()).rowwise() + motion.t.transpose();
}

Vertices wobbled(const Vertices& X, std::mt19937& random, float amount) {
    Vertices x = X;
    for (int wave = 0; wave < 4; ++wave) {
        const Eigen::Vector3f direction = 5 * uniform3(random), push = amount * uniform3(random);
        const float phase = 3 * uniform(random);
        for (Eigen::Index v = 0; v < X.rows(); ++v)
            x.row(v) += std::sin(X.row(v).dot(direction) + phase) * push.transpose();
    }
    return x;
}

}  // namespace nbd::shapes
