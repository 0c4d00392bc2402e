#include "collision/plane_filter.hpp"

#include <limits>

#include "collision/lane_mask.hpp"

namespace nbd {
namespace {

using Lanes = TrianglePack::Lanes;
using Corner = TrianglePack::Corner;

Corner operator-(const Corner& a, const Corner& b) noexcept { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Lanes dot(const Corner& a, const Corner& b) noexcept { return a.x * b.x + a.y * b.y + a.z * b.z; }
Corner abs(const Corner& a) noexcept { return {a.x.abs(), a.y.abs(), a.z.abs()}; }

/// Above 0 where the plane of t certainly has all of s strictly on one side. The determinant and its error
/// bound are those of PlaneSide, in float32: 9 half ulps of the permanent. Products may underflow here: those
/// of the normal by at most 3 * 2^-126, the last ones by as much, so 2^-120 (|w|_1 + 1) covers both. What
/// overflows becomes not a number.
Lanes separation(const TrianglePack& t, const TrianglePack& s) noexcept {
    constexpr float bound = 4.5f * std::numeric_limits<float>::epsilon(), underflow = 0x1p-120f;
    const Corner u = t.corners[1] - t.corners[0], v = t.corners[2] - t.corners[0], p = abs(u), q = abs(v);
    const Corner normal{u.y * v.z - u.z * v.y, u.z * v.x - u.x * v.z, u.x * v.y - u.y * v.x};
    const Corner size{p.y * q.z + p.z * q.y, p.z * q.x + p.x * q.z, p.x * q.y + p.y * q.x};
    Lanes above = Lanes::Constant(std::numeric_limits<float>::infinity()), below = above;
    Lanes doubt = Lanes::Zero();  // not a number where one of the sides is none: minima may lose it
    for (const Corner& corner : s.corners) {
        const Corner w = corner - t.corners[0], a = abs(w);
        const Lanes side = dot(normal, w), error = bound * dot(size, a) + underflow * (a.x + a.y + a.z + 1);
        above = above.min(side - error);
        below = below.min(-side - error);
        doubt += 0 * (side + error);
    }
    return above.max(below) + doubt;
}

}  // namespace

unsigned may_intersect(const TrianglePack& s, const TrianglePack& t) noexcept {
    const Lanes apart = separation(t, s).max(separation(s, t));
    return not_above(apart.head<8>(), 0) | not_above(apart.tail<8>(), 0) << 8;
}

}  // namespace nbd
