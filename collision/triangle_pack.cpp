#include "collision/triangle_pack.hpp"

#include <limits>

#include "collision/lane_mask.hpp"

namespace nbd {
namespace {

using Lanes = TrianglePack::Lanes;
using Corner = TrianglePack::Corner;

constexpr float inf = std::numeric_limits<float>::infinity();

Corner operator-(const Corner& a, const Corner& b) noexcept { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Lanes dot(const Corner& a, const Corner& b) noexcept { return a.x * b.x + a.y * b.y + a.z * b.z; }
Corner abs(const Corner& a) noexcept { return {a.x.abs(), a.y.abs(), a.z.abs()}; }

/// Certainty of a sign: where one of them is above 0 the sign is certainly this one. What overflows is not
/// known: `doubt` is not a number there, and 0 elsewhere; minima and maxima may lose it.
struct Sign {
    Lanes positive, negative, doubt;
};

/// det[u, v, .] for float32 differences u and v.
class Determinant {
 public:
    Determinant(const Corner& u, const Corner& v) noexcept {
        const Corner p = abs(u), q = abs(v);
        normal_ = {u.y * v.z - u.z * v.y, u.z * v.x - u.x * v.z, u.x * v.y - u.y * v.x};
        size_ = {p.y * q.z + p.z * q.y, p.z * q.x + p.x * q.z, p.x * q.y + p.y * q.x};
    }

    /// The error bound is that of PlaneSide, in float32: 9 half ulps of the permanent. Products may underflow
    /// here: those of the normal by at most 3 * 2^-126, the last ones by as much, so 2^-120 (|w|_1 + 1)
    /// covers both.
    Sign sign(const Corner& w) const noexcept {
        constexpr float bound = 4.5f * std::numeric_limits<float>::epsilon(), underflow = 0x1p-120f;
        const Corner a = abs(w);
        const Lanes value = dot(normal_, w),
                    error = bound * dot(size_, a) + underflow * (a.x + a.y + a.z + 1);
        return {value - error, -value - error, 0 * (value + error)};
    }

 private:
    Corner normal_, size_;
};

/// The sides of t's plane on which the corners of s lie.
std::array<Sign, 3> sides(const TrianglePack& s, const TrianglePack& t) noexcept {
    const auto& [a, b, c] = t.corners;
    const Determinant plane(b - a, c - a);
    return {plane.sign(s.corners[0] - a), plane.sign(s.corners[1] - a), plane.sign(s.corners[2] - a)};
}

/// The certainty that all signs, or any, are alike.
Lanes all_alike(const Sign& p, const Sign& q) noexcept {
    return p.positive.min(q.positive).max(p.negative.min(q.negative));
}
Lanes all_alike(const Sign& p, const Sign& q, const Sign& r) noexcept {
    return p.positive.min(q.positive).min(r.positive).max(p.negative.min(q.negative).min(r.negative));
}
Lanes both_occur(const Sign& p, const Sign& q) noexcept {
    return p.positive.min(q.negative).max(p.negative.min(q.positive));
}
Lanes both_occur(const Sign& p, const Sign& q, const Sign& r) noexcept {
    return p.positive.max(q.positive).max(r.positive).min(p.negative.max(q.negative).max(r.negative));
}

/// The certainty that an edge of a triangle meets another triangle in one point inside of it, and that none
/// meets it at all.
struct Certainty {
    Lanes meeting = Lanes::Constant(-inf), apart = Lanes::Constant(inf);

    /// An edge from p to q, and on which side of its line those of the other triangle pass. The edge crosses
    /// the plane where its ends lie on two sides; its line passes the triangle's inside where all three lines
    /// pass on one side, and not even its border where they pass on both.
    void add(const Sign& p, const Sign& q, const Sign& line0, const Sign& line1, const Sign& line2) noexcept {
        meeting = meeting.max(both_occur(p, q).min(all_alike(line0, line1, line2)));
        apart = apart.min(all_alike(p, q).max(both_occur(line0, line1, line2)));
    }
};

}  // namespace

unsigned separated_by_plane(const TrianglePack& s, const TrianglePack& t) noexcept {
    const std::array<Sign, 3> of_s = sides(s, t), of_t = sides(t, s);
    Lanes one_side = all_alike(of_s[0], of_s[1], of_s[2]).max(all_alike(of_t[0], of_t[1], of_t[2]));
    for (const Sign& side : of_s) one_side += side.doubt;
    for (const Sign& side : of_t) one_side += side.doubt;
    return above(one_side, 0);
}

PackVerdict edges_meet_faces(const TrianglePack& s, const TrianglePack& t) noexcept {
    const std::array<Sign, 3> of_s = sides(s, t), of_t = sides(t, s);
    Lanes doubt = Lanes::Zero();
    for (const Sign& side : of_s) doubt += side.doubt;
    for (const Sign& side : of_t) doubt += side.doubt;
    std::array<std::array<Sign, 3>, 3> passing;  // on which side of edge i of s edge j of t passes
    for (std::size_t i = 0; i < 3; ++i) {
        const Corner& start = s.corners[i];
        const Corner along = s.corners[(i + 1) % 3] - start;
        const std::array<Corner, 3> to_t{t.corners[0] - start, t.corners[1] - start, t.corners[2] - start};
        for (std::size_t j = 0; j < 3; ++j) {
            passing[i][j] = Determinant(along, to_t[j]).sign(to_t[(j + 1) % 3]);
            doubt += passing[i][j].doubt;
        }
    }
    Certainty certainty;
    for (std::size_t i = 0; i < 3; ++i) {
        certainty.add(of_s[i], of_s[(i + 1) % 3], passing[i][0], passing[i][1], passing[i][2]);
        certainty.add(of_t[i], of_t[(i + 1) % 3], passing[0][i], passing[1][i], passing[2][i]);
    }
    return {above(certainty.meeting + doubt, 0), above(certainty.apart + doubt, 0)};
}

}  // namespace nbd
