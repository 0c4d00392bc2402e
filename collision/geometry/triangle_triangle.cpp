#include "collision/geometry/triangle_triangle.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "collision/geometry/predicates.hpp"

namespace nbd {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

using Corners = TriangleCorners;
using Sides = std::array<int, 3>;

Corners corners(const Triangle& t) noexcept {
    return {t.a.cast<double>(), t.b.cast<double>(), t.c.cast<double>()};
}

template <class Point>
bool boxes_overlap(const Point& a, const Point& b, const Point& c, const Point& u, const Point& v,
                   const Point& w) noexcept {
    const auto lower = [](const auto& x, const auto& y, const auto& z) { return x.cwiseMin(y).cwiseMin(z); };
    const auto upper = [](const auto& x, const auto& y, const auto& z) { return x.cwiseMax(y).cwiseMax(z); };
    return (lower(a, b, c).array() <= upper(u, v, w).array()).all() &&
           (lower(u, v, w).array() <= upper(a, b, c).array()).all();
}

/// For each corner of s, the side of t's plane on which it lies.
Sides sides(const Corners& s, const Corners& t) noexcept {
    const PlaneSide side(t[0], t[1], t[2]);
    return {side(s[0]), side(s[1]), side(s[2])};
}

bool strictly_on_one_side(const Sides& x) noexcept { return x[0] != 0 && x[0] == x[1] && x[1] == x[2]; }
bool all_zero(const Sides& x) noexcept { return x[0] == 0 && x[1] == 0 && x[2] == 0; }

Vector2d drop(const Vector3d& x, int axis) noexcept { return {x[(axis + 1) % 3], x[(axis + 2) % 3]}; }

/// An axis along which a, b and c project onto a proper triangle; empty if they are collinear.
std::optional<int> projection_axis(const Vector3d& a, const Vector3d& b, const Vector3d& c) noexcept {
    for (int axis = 0; axis < 3; ++axis)
        if (orient2d(drop(a, axis), drop(b, axis), drop(c, axis)) != 0) return axis;
    return std::nullopt;
}

/// Whether the line through some edge of s has all of t strictly on one side and no corner of s on that side.
bool edge_separates(const std::array<Vector2d, 3>& s, const std::array<Vector2d, 3>& t) noexcept {
    for (int i = 0; i < 3; ++i) {
        const Vector2d &p = s[i], &q = s[(i + 1) % 3], &opposite = s[(i + 2) % 3];
        const int side = orient2d(p, q, t[0]);
        if (side != 0 && orient2d(p, q, t[1]) == side && orient2d(p, q, t[2]) == side &&
            orient2d(p, q, opposite) != side)
            return true;
    }
    return false;
}

/// Requires s and t in one plane that projects one-to-one along `axis`, and not all on one line. The edges of
/// their Minkowski difference are then edges of s or t, so disjoint triangles are separated along an edge.
bool planar_triangles_intersect(const Corners& s, const Corners& t, int axis) noexcept {
    const std::array<Vector2d, 3> s2{drop(s[0], axis), drop(s[1], axis), drop(s[2], axis)};
    const std::array<Vector2d, 3> t2{drop(t[0], axis), drop(t[1], axis), drop(t[2], axis)};
    return !edge_separates(s2, t2) && !edge_separates(t2, s2);
}

bool lexicographically_less(const Vector3d& a, const Vector3d& b) noexcept {
    return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
}

/// End points, in lexicographic order, of a triangle with collinear corners.
std::pair<Vector3d, Vector3d> segment_of(const Corners& t) noexcept {
    const auto [first, last] = std::minmax_element(t.begin(), t.end(), lexicographically_less);
    return {*first, *last};
}

/// Requires that each triangle is a segment or a point and that their boxes overlap.
bool segments_intersect(const Corners& s, const Corners& t) noexcept {
    const auto [p, q] = segment_of(s);
    const auto [u, v] = segment_of(t);
    if (orient3d(p, q, u, v) != 0) return false;
    std::optional<int> axis = projection_axis(p, q, u);
    if (!axis) axis = projection_axis(u, v, p);
    if (axis) return planar_triangles_intersect(s, t, *axis);
    return true;  // p equals u, or all lie on one line: overlapping boxes mean overlapping segments
}

/// Whether the point where s meets the plane of t is in t. Requires a segment or point s that neither lies in
/// the plane of the proper triangle t nor strictly on one side of it.
bool segment_pierces(const Corners& s, const Corners& t) noexcept {
    const auto [p, q] = segment_of(s);
    int least = 1, most = -1;
    for (int i = 0; i < 3; ++i) {
        const int side = orient3d(p, q, t[i], t[(i + 1) % 3]);
        least = std::min(least, side);
        most = std::max(most, side);
    }
    return least >= 0 || most <= 0;
}

/// Rotates the corners of s, without mirroring, until the first is alone: no other corner lies on its side of
/// t's plane or, if it lies in the plane, both others lie on one side.
/// side: the sides of t's plane for the corners of s; not all zero, not strictly on one side.
/// Returns whether t must be mirrored so that s[0] lies above or in its plane and the others lie below or in
/// it.
bool turn_to_lone_corner(Corners& s, Sides side) noexcept {
    const auto is_alone = [](int own, int next, int last) {
        return own == 0 ? next == last && next != 0 : own * next <= 0 && own * last <= 0;
    };
    while (!is_alone(side[0], side[1], side[2])) {
        std::rotate(side.begin(), side.begin() + 1, side.end());
        std::rotate(s.begin(), s.begin() + 1, s.end());
    }
    return side[0] < 0 || side[1] > 0;
}

/// Requires proper triangles in different planes, each meeting the other's plane. Both cut the common line of
/// the planes in an interval; an orientation test of four corners gives the order of two interval ends.
/// Source: [GuigueDevillers03].
bool crossing_triangles_intersect(Corners s, const Sides& side_s, Corners t, const Sides& side_t) noexcept {
    const bool mirror_t = turn_to_lone_corner(s, side_s), mirror_s = turn_to_lone_corner(t, side_t);
    if (mirror_s) std::swap(s[1], s[2]);
    if (mirror_t) std::swap(t[1], t[2]);
    return orient3d(s[0], s[1], t[0], t[1]) <= 0 && orient3d(s[0], s[2], t[2], t[0]) <= 0;
}

/// Requires that the boxes of the triangles overlap.
bool near_triangles_intersect(const Corners& s, const Corners& t) noexcept {
    const Sides side_s = sides(s, t);
    if (strictly_on_one_side(side_s)) return false;
    const Sides side_t = sides(t, s);
    if (strictly_on_one_side(side_t)) return false;
    const bool s_in_plane = all_zero(side_s), t_in_plane = all_zero(side_t);
    if (!s_in_plane && !t_in_plane) return crossing_triangles_intersect(s, side_s, t, side_t);

    // The triangles share a plane, or one is degenerate: its "plane" contains every point.
    const std::optional<int> axis_s = projection_axis(s[0], s[1], s[2]);
    const std::optional<int> axis_t = projection_axis(t[0], t[1], t[2]);
    if (!axis_s && !axis_t) return segments_intersect(s, t);
    if (axis_t && s_in_plane) return planar_triangles_intersect(s, t, *axis_t);
    if (axis_s && t_in_plane) return planar_triangles_intersect(s, t, *axis_s);
    return axis_t ? segment_pierces(s, t) : segment_pierces(t, s);
}

}  // namespace

bool triangles_intersect(const Triangle& a, const Triangle& b) noexcept {
    return boxes_overlap(a.a, a.b, a.c, b.a, b.b, b.c) && near_triangles_intersect(corners(a), corners(b));
}

bool double_triangles_intersect(const TriangleCorners& s, const TriangleCorners& t) noexcept {
    return boxes_overlap(s[0], s[1], s[2], t[0], t[1], t[2]) && near_triangles_intersect(s, t);
}

}  // namespace nbd
