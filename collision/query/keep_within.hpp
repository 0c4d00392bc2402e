#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "collision/geometry/closest_points.hpp"

namespace nbd {

/// Whether two triangles are within `distance`, if their corners, the balls around them or a plane between
/// them tell.
inline std::optional<bool> surely_within(const Triangle& a, const Triangle& b, double distance) noexcept {
    constexpr double rounding = 1e-12;  // more than that of all steps below and of triangle_distance()
    const auto corners = [](const Triangle& t) {
        return std::array<Eigen::Vector3d, 3>{t.a.cast<double>(), t.b.cast<double>(), t.c.cast<double>()};
    };
    const auto in_a = corners(a), in_b = corners(b);
    double least = (in_a[0] - in_b[0]).squaredNorm();
    for (const auto& p : in_a)
        for (const auto& q : in_b) least = std::min(least, (p - q).squaredNorm());
    if (least <= distance * distance * (1 - rounding)) return true;
    const Eigen::Vector3d centre_a = (in_a[0] + in_a[1] + in_a[2]) / 3,
                          centre_b = (in_b[0] + in_b[1] + in_b[2]) / 3;
    double radius_a = 0, radius_b = 0, size = 0;
    for (const auto& p : in_a) radius_a = std::max(radius_a, (p - centre_a).squaredNorm());
    for (const auto& p : in_b) radius_b = std::max(radius_b, (p - centre_b).squaredNorm());
    for (const auto* corners_of : {&in_a, &in_b})
        for (const auto& p : *corners_of) size = std::max(size, p.cwiseAbs().maxCoeff());
    const double most = distance + std::sqrt(radius_a) + std::sqrt(radius_b) + rounding * size;
    const Eigen::Vector3d along = centre_b - centre_a;
    if (along.squaredNorm() > most * most * (1 + rounding)) return false;
    // The triangles are at least as far apart as what they cover of a line.
    double end_a = along.dot(in_a[0]), begin_b = along.dot(in_b[0]);
    for (std::size_t k = 1; k < 3; ++k) {
        end_a = std::max(end_a, along.dot(in_a[k]));
        begin_b = std::min(begin_b, along.dot(in_b[k]));
    }
    if (begin_b - end_a > (distance + rounding * size) * along.norm() * (1 + rounding)) return false;
    return std::nullopt;
}

/// Keeps the pairs of faces whose triangles are at most `distance` apart, metres, in their order. a, b:
/// PosedFaces or AffineBoxes, as for keep_intersecting().
template <class Posed>
void keep_within(std::vector<FacePair>& pairs, const Posed& a, const Posed& b, float distance) noexcept {
    std::erase_if(pairs, [&](const FacePair& pair) {
        const Triangle s = a.triangle(pair.a), t = b.triangle(pair.b);
        const std::optional<bool> sure = surely_within(s, t, double{distance});
        return !(sure ? *sure : triangle_distance(s, t) <= double{distance});
    });
}

}  // namespace nbd
