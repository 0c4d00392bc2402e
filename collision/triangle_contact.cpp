#include "collision/triangle_contact.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <limits>

#include "collision/triangle_triangle.hpp"

namespace nbd {
namespace {

using Eigen::Vector3d;

using Corners = std::array<Vector3d, 3>;

/// How far a must move along d to leave b behind.
double translation_along(const Vector3d& d, const Corners& a, const Corners& b) noexcept {
    return std::max({d.dot(b[0]), d.dot(b[1]), d.dot(b[2])}) -
           std::min({d.dot(a[0]), d.dot(a[1]), d.dot(a[2])});
}

/// A direction that a may leave in, and the way to go.
struct Separation {
    Vector3d direction = Vector3d::UnitZ();
    double length = std::numeric_limits<double>::infinity();
};

/// Tries the unit vector of `d` and its opposite, as far as they do not oppose `outward`. None if d is zero.
void try_both_ways(Separation& best, const Vector3d& d, const Vector3d& outward, const Corners& a,
                   const Corners& b) noexcept {
    const double norm = d.norm();
    if (!(norm > 0)) return;
    for (const double sign : {1., -1.}) {
        const Vector3d unit = sign / norm * d;
        if (unit.dot(outward) < 0) continue;
        const double length = translation_along(unit, a, b);
        if (length < best.length) best = {unit, length};
    }
}

Vector3d normal(const Corners& t) noexcept { return (t[1] - t[0]).cross(t[2] - t[0]); }

Vector3d unit_or_zero(const Vector3d& x) noexcept {
    const double norm = x.norm();
    return norm > 0 ? Vector3d(x / norm) : Vector3d::Zero();
}

/// A vector at right angles to x, not zero unless x is.
Vector3d perpendicular(const Vector3d& x) noexcept {
    Eigen::Index least;
    x.cwiseAbs().minCoeff(&least);
    return x.cross(Vector3d::Unit(least));
}

/// apart: any way round is fine then, as one of them leads through the gap.
Separation least_separation(const Corners& a, const Corners& b, bool apart) noexcept {
    const Vector3d normal_a = normal(a), normal_b = normal(b);
    Vector3d outward = Vector3d::Zero();
    if (!apart) outward = unit_or_zero(normal_b) - unit_or_zero(normal_a);
    Separation best;
    try_both_ways(best, normal_b, outward, a, b);
    try_both_ways(best, normal_a, outward, a, b);
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            try_both_ways(best, (a[(i + 1) % 3] - a[i]).cross(b[(j + 1) % 3] - b[j]), outward, a, b);
    // What is left are points and segments on one line: any way to the side will do.
    for (int i = 0; i < 3 && best.length == std::numeric_limits<double>::infinity(); ++i) {
        try_both_ways(best, perpendicular(a[(i + 1) % 3] - a[i]), outward, a, b);
        try_both_ways(best, perpendicular(b[(i + 1) % 3] - b[i]), outward, a, b);
    }
    if (best.length == std::numeric_limits<double>::infinity()) best.length = 0;
    return best;
}

}  // namespace

TriangleContact triangle_contact(const Triangle& a, const Triangle& b) noexcept {
    const ClosestPoints at = closest_triangle_triangle(a, b);
    const Vector3d origin = a.a.cast<double>();
    const auto local = [&](const Triangle& t) {
        return Corners{t.a.cast<double>() - origin, t.b.cast<double>() - origin, t.c.cast<double>() - origin};
    };
    const Corners s = local(a), t = local(b);
    double size = 0;
    for (const Corners& x : {s, t})
        for (const Vector3d& corner : x) size = std::max(size, corner.cwiseAbs().maxCoeff());
    // The gap is off by some 1e-16 of the size; beyond this its direction is good to a millionth.
    if (at.distance > 1e-10 * size) return {at, at.gap / at.distance, -at.distance};
    const bool apart = !triangles_intersect(a, b);
    const Separation way = least_separation(s, t, apart);
    return {at, way.direction, apart ? -at.distance : way.length};
}

}  // namespace nbd
