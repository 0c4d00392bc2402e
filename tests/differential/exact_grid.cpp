#include "tests/differential/exact_grid.hpp"

#include <Eigen/Geometry>
#include <algorithm>

namespace nbd::test {
namespace {

using Whole = std::int64_t;

GridPoint normal_of(const GridTriangle& t) { return (t[1] - t[0]).cross(t[2] - t[0]); }

bool is_on_segment(const GridPoint& x, const GridPoint& p, const GridPoint& q) {
    return (x - p).cross(q - p).isZero(0) && (x - p).dot(x - q) <= 0;
}

bool segments_meet(const GridPoint& p, const GridPoint& q, const GridPoint& u, const GridPoint& v) {
    const GridPoint d = q - p, e = v - u, r = u - p, c = d.cross(e);
    if (c.isZero(0))
        return is_on_segment(p, u, v) || is_on_segment(q, u, v) || is_on_segment(u, p, q) ||
               is_on_segment(v, p, q);
    if (r.dot(c) != 0) return false;
    const Whole along_d = r.cross(e).dot(c), along_e = r.cross(d).dot(c), whole = c.squaredNorm();
    return 0 <= along_d && along_d <= whole && 0 <= along_e && along_e <= whole;
}

bool segment_meets_an_edge(const GridPoint& p, const GridPoint& q, const GridTriangle& t) {
    return segments_meet(p, q, t[0], t[1]) || segments_meet(p, q, t[1], t[2]) ||
           segments_meet(p, q, t[2], t[0]);
}

/// Whether the point x / scale of the triangle's plane lies in the triangle, whose normal is n, not zero.
bool is_inside(const GridPoint& x, Whole scale, const GridTriangle& t, const GridPoint& n) {
    for (int i = 0; i < 3; ++i) {
        const GridPoint &a = t[i], &b = t[(i + 1) % 3];
        if ((b - a).cross(x - scale * a).dot(n) < 0) return false;
    }
    return true;
}

bool segment_meets_triangle(const GridPoint& p, const GridPoint& q, const GridTriangle& t) {
    const GridPoint n = normal_of(t);
    if (n.isZero(0)) return segment_meets_an_edge(p, q, t);
    const Whole at_p = n.dot(p - t[0]), at_q = n.dot(q - t[0]);
    if ((at_p > 0 && at_q > 0) || (at_p < 0 && at_q < 0)) return false;
    if (at_p == 0 && at_q == 0) return is_inside(p, 1, t, n) || segment_meets_an_edge(p, q, t);
    const Whole p_share = at_q > at_p ? at_q : -at_q, q_share = at_q > at_p ? -at_p : at_p;
    return is_inside(p_share * p + q_share * q, p_share + q_share, t, n);
}

double quotient(Whole a, Whole b) { return static_cast<double>(static_cast<long double>(a) / b); }

double point_segment(const GridPoint& x, const GridPoint& p, const GridPoint& q) {
    const GridPoint d = q - p;
    const Whole along = (x - p).dot(d), whole = d.squaredNorm();
    if (along <= 0) return static_cast<double>((x - p).squaredNorm());
    if (along >= whole) return static_cast<double>((x - q).squaredNorm());
    return quotient((x - p).cross(d).squaredNorm(), whole);
}

}  // namespace

bool grid_triangles_intersect(const GridTriangle& s, const GridTriangle& t) {
    for (std::size_t i = 0; i < 3; ++i)
        if (segment_meets_triangle(s[i], s[(i + 1) % 3], t) ||
            segment_meets_triangle(t[i], t[(i + 1) % 3], s))
            return true;
    return false;
}

double grid_point_triangle(const GridPoint& p, const GridTriangle& t) {
    const GridPoint n = normal_of(t);
    const Whole height = n.dot(p - t[0]), whole = n.squaredNorm();
    // The foot of the perpendicular is p - n height / whole.
    if (whole > 0 && is_inside(whole * p - height * n, whole, t, n)) return quotient(height * height, whole);
    return std::min(
        {point_segment(p, t[0], t[1]), point_segment(p, t[1], t[2]), point_segment(p, t[2], t[0])});
}

double grid_edge_edge(const GridPoint& p, const GridPoint& q, const GridPoint& u, const GridPoint& v) {
    const GridPoint d = q - p, e = v - u, r = u - p, c = d.cross(e);
    const Whole along_d = r.cross(e).dot(c), along_e = r.cross(d).dot(c), whole = c.squaredNorm();
    if (whole > 0 && 0 <= along_d && along_d <= whole && 0 <= along_e && along_e <= whole)
        return quotient(r.dot(c) * r.dot(c), whole);
    return std::min(
        {point_segment(p, u, v), point_segment(q, u, v), point_segment(u, p, q), point_segment(v, p, q)});
}

double grid_triangle_triangle(const GridTriangle& s, const GridTriangle& t) {
    if (grid_triangles_intersect(s, t)) return 0;
    double least = grid_point_triangle(s[0], t);
    for (std::size_t i = 0; i < 3; ++i) {
        least = std::min({least, grid_point_triangle(s[i], t), grid_point_triangle(t[i], s)});
        for (std::size_t j = 0; j < 3; ++j)
            least = std::min(least, grid_edge_edge(s[i], s[(i + 1) % 3], t[j], t[(j + 1) % 3]));
    }
    return least;
}

}  // namespace nbd::test
