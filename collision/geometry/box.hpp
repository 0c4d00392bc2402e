#pragma once

#include <algorithm>
#include <limits>

#include "collision/geometry/geometry.hpp"

namespace nbd {

/// Axis-aligned box, metres. Four lanes, the last one 0, so that a box fills two vector registers.
struct Box {
    Eigen::Array4f lo, hi;
};

/// The empty box: infinitely far from every box; joined with a box it gives that box.
inline Box empty_box() noexcept {
    constexpr float inf = std::numeric_limits<float>::infinity();
    return {{inf, inf, inf, 0}, {-inf, -inf, -inf, 0}};
}

inline Box joined(const Box& s, const Box& t) noexcept { return {s.lo.min(t.lo), s.hi.max(t.hi)}; }

/// Whether all sides are finite numbers.
inline bool is_finite(const Box& box) noexcept { return (0 * (box.lo + box.hi).head<3>() == 0).all(); }

/// Smallest sphere around both, rounded up; not finite where they are not. Points that move straight from s
/// to t stay inside it, since it is convex.
inline Sphere joined(const Sphere& s, const Sphere& t) noexcept {
    const Eigen::Vector3d from = s.c.cast<double>(), way = t.c.cast<double>() - from;
    const double between = way.norm(), r_s = s.r, r_t = t.r;
    // The centre stands this far on the way from s to t; at an end if one sphere holds the other.
    const double along = std::clamp((between + r_t - r_s) / 2, 0.0, between);
    const Eigen::Vector3d c = from + (between == 0 ? 0 : along / between) * way;
    // The centre is rounded by half an ulp. Not measured again: gcc 12 optimises rounding and back away.
    constexpr double half_ulp = std::numeric_limits<float>::epsilon() / 2;
    const double r = std::max(along + r_s, between - along + r_t) + half_ulp * c.norm();
    constexpr float up = 1 + 2 * std::numeric_limits<float>::epsilon();
    return {c.cast<float>(), static_cast<float>(r) * up};
}

/// How far `inner` protrudes from `outer` on the worst side, metres; negative if all sides leave room.
inline float outside(const Box& outer, const Box& inner) noexcept {
    return (outer.lo - inner.lo).max(inner.hi - outer.hi).head<3>().maxCoeff();
}

/// Smallest box around a triangle. Exact: its sides are coordinates of the triangle.
inline Box bounding_box(const Triangle& t) noexcept {
    const Eigen::Array3f lo = t.a.cwiseMin(t.b).cwiseMin(t.c), hi = t.a.cwiseMax(t.b).cwiseMax(t.c);
    return {{lo[0], lo[1], lo[2], 0}, {hi[0], hi[1], hi[2], 0}};
}

/// Threshold for a squared length computed in float32 from coordinate differences: above it, the length
/// certainly exceeds `limit`. The differences, the three squares and their sum are off by at most 3 ulp; the
/// rest allows for `limit` being a rounded sum.
inline float certain_square(float limit) noexcept {
    constexpr float slack = 1 + 16 * std::numeric_limits<float>::epsilon();
    return limit * limit * slack + std::numeric_limits<float>::min();
}

/// Whether no point of s is within `distance` of a point of t. Never true in error; may be false if they are
/// apart by only a few ulp.
inline bool apart(const Sphere& s, const Sphere& t, float distance) noexcept {
    return (s.c - t.c).squaredNorm() > certain_square(s.r + t.r + distance);
}
inline bool apart(const Box& s, const Box& t, float distance) noexcept {
    const Eigen::Array4f gap = (s.lo - t.hi).max(t.lo - s.hi).max(0.f);
    return gap.square().sum() > certain_square(distance);
}

}  // namespace nbd
