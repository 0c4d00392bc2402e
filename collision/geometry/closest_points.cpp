#include "collision/geometry/closest_points.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "collision/geometry/triangle_triangle.hpp"

namespace nbd {
namespace {

using Eigen::Vector3d;

using Corners = std::array<Vector3d, 3>;

/// 1 / x, or 0 unless x > 0.
double inverse(double x) noexcept { return x > 0 ? 1 / x : 0; }

/// A triangle and the values that all tests against it share.
struct Face {
    explicit Face(const Corners& x) noexcept
        : corner(x), edge{x[1] - x[0], x[2] - x[1], x[0] - x[2]}, normal(edge[0].cross(edge[1])) {
        for (int i = 0; i < 3; ++i) edge_inverse[i] = inverse(edge[i].squaredNorm());
        const double normal_inverse = inverse(normal.squaredNorm());
        has_area = normal_inverse > 0;
        slope_1 = normal_inverse * normal.cross(edge[2]);
        slope_2 = normal_inverse * normal.cross(edge[0]);
    }

    Corners corner, edge;                // edge i leads from corner i to the next one
    Vector3d normal;                     // not normalised
    std::array<double, 3> edge_inverse;  // 1 / squared length
    bool has_area;
    Vector3d slope_1, slope_2;  // slope_i.dot(x - corner[0]) = weight of corner i at the projection of x
};

/// The closest features found so far: points on two edges, or a point in a face and a corner.
struct Nearest {
    enum On { edges, face_b, face_a };  // a face is paired with a corner of the other triangle
    On on = edges;
    int i = 0, j = 0;     // edge or corner of a and of b
    double s = 0, t = 0;  // edges: parameters along i and j; face: weights of its corners 1 and 2
    double squared = std::numeric_limits<double>::infinity();  // squared distance
};

void keep_closer(Nearest& best, const Vector3d& gap, Nearest other) noexcept {
    other.squared = gap.squaredNorm();
    if (other.squared < best.squared) best = other;
}

struct WeightPair {
    Vector3d a, b;
};

WeightPair weights(const Nearest& n) noexcept {
    const auto on_edge = [](int i, double along) {
        Vector3d w = Vector3d::Zero();
        w[i] = 1 - along;
        w[(i + 1) % 3] = along;
        return w;
    };
    const Vector3d on_face(1 - n.s - n.t, n.s, n.t);
    if (n.on == Nearest::face_b) return {on_edge(n.i, 0), on_face};
    if (n.on == Nearest::face_a) return {on_face, on_edge(n.j, 0)};
    return {on_edge(n.i, n.s), on_edge(n.j, n.t)};
}

double unit_interval(double x) noexcept { return std::min(std::max(x, 0.), 1.); }

/// Tests all pairs of corner and edge, corner and face, edge and edge. Each candidate is a point of either
/// triangle, so rounding in a sliver costs at most the sliver's width.
Nearest nearest_features(const Face& a, const Face& b) noexcept {
    Nearest best;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
            const Vector3d &u = a.edge[i], &v = b.edge[j], w = a.corner[i] - b.corner[j];
            const double w_v = w.dot(v) * b.edge_inverse[j], w_u = -w.dot(u) * a.edge_inverse[i];
            double t = unit_interval(w_v), s = unit_interval(w_u);
            keep_closer(best, w - t * v, {Nearest::edges, i, j, 0, t});
            keep_closer(best, w + s * u, {Nearest::edges, i, j, s, 0});
            // Points inside both edges. For nearly parallel edges s has a large error, so t is then optimised
            // for that s, and s for that t.
            const Vector3d normal = u.cross(v);
            const double u_v = u.dot(v);
            s = unit_interval(v.cross(w).dot(normal) * inverse(normal.squaredNorm()));
            t = unit_interval(w_v + s * u_v * b.edge_inverse[j]);
            s = unit_interval(w_u + t * u_v * a.edge_inverse[i]);
            keep_closer(best, w + s * u - t * v, {Nearest::edges, i, j, s, t});
        }
    for (int i = 0; b.has_area && i < 3; ++i) {
        const Vector3d x = a.corner[i] - b.corner[0];
        const double s = b.slope_1.dot(x), t = b.slope_2.dot(x);
        if (s >= 0 && t >= 0 && 1 - s - t >= 0)
            keep_closer(best, x - s * b.edge[0] + t * b.edge[2], {Nearest::face_b, i, 0, s, t});
    }
    for (int j = 0; a.has_area && j < 3; ++j) {
        const Vector3d x = b.corner[j] - a.corner[0];
        const double s = a.slope_1.dot(x), t = a.slope_2.dot(x);
        if (s >= 0 && t >= 0 && 1 - s - t >= 0)
            keep_closer(best, s * a.edge[0] - t * a.edge[2] - x, {Nearest::face_a, 0, j, s, t});
    }
    return best;
}

Vector3d point(const Corners& x, const Vector3d& w) noexcept {
    return w[0] * x[0] + w[1] * x[1] + w[2] * x[2];
}

/// Ends of the segment that two triangles share, as found so far.
struct CommonSegment {
    WeightPair first, last;
    double first_along = std::numeric_limits<double>::infinity(), last_along = -first_along;
};

/// Extends the common segment, which runs along `line`, to the points where edges of s pierce t.
/// s_is_a: whether s is triangle a of the pair. tolerance: largest distance from t that rounding may give
/// such a point, metres.
void add_piercings(CommonSegment& common, const Face& s, const Face& t, const Vector3d& line, bool s_is_a,
                   double tolerance) noexcept {
    std::array<double, 3> height;
    for (int i = 0; i < 3; ++i) height[i] = t.normal.dot(s.corner[i] - t.corner[0]);
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3;
        const auto [low, high] = std::minmax(height[i], height[j]);
        if (!(low <= 0 && high >= 0 && low < high)) continue;
        const double along_edge = height[i] / (height[i] - height[j]);
        const Vector3d x = s.corner[i] + along_edge * s.edge[i], from_corner = x - t.corner[0];
        const double weight_1 = t.slope_1.dot(from_corner), weight_2 = t.slope_2.dot(from_corner);
        Vector3d on_t = Vector3d(1 - weight_1 - weight_2, weight_1, weight_2).cwiseMax(0);
        on_t /= on_t.sum();
        if (!((point(t.corner, on_t) - x).squaredNorm() <= tolerance * tolerance)) continue;
        Vector3d on_s = Vector3d::Zero();
        on_s[i] = 1 - along_edge;
        on_s[j] = along_edge;
        const WeightPair pierced = s_is_a ? WeightPair{on_s, on_t} : WeightPair{on_t, on_s};
        const double along = line.dot(x);
        if (along < common.first_along) common.first = pierced, common.first_along = along;
        if (along > common.last_along) common.last = pierced, common.last_along = along;
    }
}

/// A common point of two triangles that intersect.
WeightPair common_point(const Face& a, const Face& b) noexcept {
    const Vector3d line = a.normal.cross(b.normal);
    double size = 0;
    for (int i = 0; i < 3; ++i) size = std::max({size, a.edge[i].norm(), b.edge[i].norm()});
    CommonSegment common;
    add_piercings(common, a, b, line, true, 1e-10 * size);
    add_piercings(common, b, a, line, false, 1e-10 * size);
    if (common.first_along > common.last_along) return weights(nearest_features(a, b));  // coplanar
    return {(common.first.a + common.last.a) / 2, (common.first.b + common.last.b) / 2};
}

Corners corners(const Triangle& t, const Vector3d& origin) noexcept {
    return {t.a.cast<double>() - origin, t.b.cast<double>() - origin, t.c.cast<double>() - origin};
}

/// a, b: corners relative to `origin`, a point near both, so that no digits are lost far from the world's
/// origin.
ClosestPoints closest_points(const Corners& a, const Corners& b, const WeightPair& w,
                             const Vector3d& origin) noexcept {
    const Vector3d p = point(a, w.a), q = point(b, w.b), gap = p - q;
    return {p + origin, q + origin, w.a, w.b, gap, gap.norm()};
}

}  // namespace

ClosestPoints closest_point_triangle(const Vector3d& p, const Vector3d& u, const Vector3d& v,
                                     const Vector3d& w) noexcept {
    const Face face(Corners{u - p, v - p, w - p});
    Nearest best;
    for (int j = 0; j < 3; ++j) {
        const double t = unit_interval(-face.corner[j].dot(face.edge[j]) * face.edge_inverse[j]);
        keep_closer(best, -face.corner[j] - t * face.edge[j], {Nearest::edges, 0, j, 0, t});
    }
    if (face.has_area) {
        const double s = -face.slope_1.dot(face.corner[0]), t = -face.slope_2.dot(face.corner[0]);
        if (s >= 0 && t >= 0 && 1 - s - t >= 0)
            keep_closer(best, t * face.edge[2] - s * face.edge[0] - face.corner[0],
                        {Nearest::face_b, 0, 0, s, t});
    }
    return closest_points(Corners{Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero()}, face.corner,
                          weights(best), p);
}

ClosestPoints closest_edge_edge(const Vector3d& p, const Vector3d& q, const Vector3d& u,
                                const Vector3d& v) noexcept {
    const Vector3d a = q - p, b = v - u, from_u = p - u, from_v = p - v;
    const double a_inverse = inverse(a.squaredNorm()), b_inverse = inverse(b.squaredNorm());
    double best_s = 0, best_t = 0, least = std::numeric_limits<double>::infinity();
    Vector3d best_gap = from_u;
    const auto keep = [&](double s, double t, const Vector3d& gap) {
        if (const double squared = gap.squaredNorm(); squared < least) {
            best_s = s;
            best_t = t;
            best_gap = gap;
            least = squared;
        }
    };
    // The ends of each edge with the other.
    const double t_of_p = unit_interval(from_u.dot(b) * b_inverse);
    const double t_of_q = unit_interval((from_u + a).dot(b) * b_inverse);
    const double s_of_u = unit_interval(-from_u.dot(a) * a_inverse);
    const double s_of_v = unit_interval(-from_v.dot(a) * a_inverse);
    keep(0, t_of_p, from_u - t_of_p * b);
    keep(1, t_of_q, from_u + a - t_of_q * b);
    keep(s_of_u, 0, from_u + s_of_u * a);
    keep(s_of_v, 1, from_v + s_of_v * a);
    // Points inside both edges. For nearly parallel edges s has a large error, so t is then optimised for
    // that s, and s for that t.
    const Vector3d normal = a.cross(b);
    const double a_b = a.dot(b);
    double s = unit_interval(b.cross(from_u).dot(normal) * inverse(normal.squaredNorm()));
    const double t = unit_interval((from_u.dot(b) + s * a_b) * b_inverse);
    s = unit_interval((t * a_b - from_u.dot(a)) * a_inverse);
    keep(s, t, from_u + s * a - t * b);
    return {p + best_s * a,          u + best_t * b, {1 - best_s, best_s, 0},
            {1 - best_t, best_t, 0}, best_gap,       std::sqrt(least)};
}

ClosestPoints closest_triangle_triangle(const Triangle& a, const Triangle& b) noexcept {
    const Vector3d origin = a.a.cast<double>();
    const Corners s = corners(a, origin), t = corners(b, origin);
    const Face face_a(s), face_b(t);
    if (!triangles_intersect(a, b))
        return closest_points(s, t, weights(nearest_features(face_a, face_b)), origin);
    ClosestPoints common = closest_points(s, t, common_point(face_a, face_b), origin);
    common.gap.setZero();
    common.distance = 0;
    return common;
}

double triangle_distance(const Triangle& a, const Triangle& b) noexcept {
    if (triangles_intersect(a, b)) return 0;
    const Vector3d origin = a.a.cast<double>();
    return std::sqrt(nearest_features(Face(corners(a, origin)), Face(corners(b, origin))).squared);
}

}  // namespace nbd
