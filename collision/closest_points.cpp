#include "collision/closest_points.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "collision/triangle_triangle.hpp"

namespace nbd {
namespace {

using Eigen::Vector3d;

using Corners = std::array<Vector3d, 3>;

/// A point of each feature by its weights, and what lies between them.
struct Candidate {
    Vector3d weights_a, weights_b, gap;
    double squared = std::numeric_limits<double>::infinity();
};

Candidate candidate(const Vector3d& weights_a, const Vector3d& weights_b, const Vector3d& gap) noexcept {
    return {weights_a, weights_b, gap, gap.squaredNorm()};
}

void keep_closer(Candidate& best, const Candidate& other) noexcept {
    if (other.squared < best.squared) best = other;
}

Candidate swapped(const Candidate& c) noexcept { return {c.weights_b, c.weights_a, -c.gap, c.squared}; }

Vector3d corner(int i) noexcept { return Vector3d::Unit(i); }

/// Weights of a point of the edge from corner i to the next one.
Vector3d on_edge(int i, double t) noexcept {
    Vector3d weights = Vector3d::Zero();
    weights[i] = 1 - t;
    weights[(i + 1) % 3] = t;
    return weights;
}

/// The t in [0, 1] for which t * direction comes closest to the point; 0 if the direction is zero.
double project(const Vector3d& point, const Vector3d& direction) noexcept {
    const double squared = direction.squaredNorm();
    return squared > 0 ? std::clamp(point.dot(direction) / squared, 0., 1.) : 0.;
}

/// a: p as corner 0. The foot of the perpendicular, where it falls into the triangle, and the best point of
/// each edge: every candidate is a point of the triangle, so rounding in a sliver costs no more than its
/// width.
Candidate nearest_on_triangle(const Vector3d& p, const Corners& t) noexcept {
    Candidate best;
    for (int i = 0; i < 3; ++i) {
        const Vector3d edge = t[(i + 1) % 3] - t[i], w = p - t[i];
        const double along = project(w, edge);
        keep_closer(best, candidate(corner(0), on_edge(i, along), w - along * edge));
    }
    const Vector3d u = t[1] - t[0], v = t[2] - t[0], w = p - t[0], normal = u.cross(v);
    const double squared = normal.squaredNorm();
    if (squared > 0) {
        const double weight_u = w.cross(v).dot(normal) / squared, weight_v = u.cross(w).dot(normal) / squared;
        const Vector3d weights(1 - weight_u - weight_v, weight_u, weight_v);
        if ((weights.array() >= 0).all())
            keep_closer(best, candidate(corner(0), weights, w - weight_u * u - weight_v * v));
    }
    return best;
}

/// Points inside two edges p + s u and q + t v, which lie `w` = q - p apart at their starts; infinitely far
/// if they are parallel. Edges that come closest at an end of one are not found here.
/// Nearly parallel ones get s with a large error, which the two projections after it take back.
Candidate between_edges(const Vector3d& u, const Vector3d& v, const Vector3d& w, int i, int j) noexcept {
    const Vector3d normal = u.cross(v);
    const double squared = normal.squaredNorm();
    if (!(squared > 0)) return {};
    double s = std::clamp(w.cross(v).dot(normal) / squared, 0., 1.);
    const double t = project(s * u - w, v);
    s = project(w + t * v, u);
    return candidate(on_edge(i, s), on_edge(j, t), s * u - w - t * v);
}

Candidate nearest_features(const Corners& s, const Corners& t) noexcept {
    Candidate best;
    for (int i = 0; i < 3; ++i) {
        Candidate c = nearest_on_triangle(s[i], t);
        c.weights_a = corner(i);
        keep_closer(best, c);
        c = swapped(nearest_on_triangle(t[i], s));
        c.weights_b = corner(i);
        keep_closer(best, c);
        for (int j = 0; j < 3; ++j)
            keep_closer(best, between_edges(s[(i + 1) % 3] - s[i], t[(j + 1) % 3] - t[j], t[j] - s[i], i, j));
    }
    return best;
}

/// The ends of the segment that two triangles share, as far as they were found.
struct CommonSegment {
    Candidate first, last;
    double first_along = std::numeric_limits<double>::infinity(), last_along = -first_along;
};

/// Widens the common segment, which runs along `line`, by the points where edges of s pass through t.
/// s_is_a: whether s is the pair's a. tolerance: how far from t rounding may put such a point.
void add_piercings(CommonSegment& common, const Corners& s, const Corners& t, const Vector3d& line,
                   bool s_is_a, double tolerance) noexcept {
    const Vector3d normal = (t[1] - t[0]).cross(t[2] - t[0]);
    std::array<double, 3> height;
    for (int i = 0; i < 3; ++i) height[i] = normal.dot(s[i] - t[0]);
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3;
        if (height[i] == height[j] || (height[i] > 0 && height[j] > 0) || (height[i] < 0 && height[j] < 0))
            continue;
        const double along_edge = height[i] / (height[i] - height[j]);
        const Vector3d x = s[i] + along_edge * (s[j] - s[i]);
        Candidate c = nearest_on_triangle(x, t);
        if (!(c.squared <= tolerance * tolerance)) continue;
        c.weights_a = on_edge(i, along_edge);
        if (!s_is_a) c = swapped(c);
        const double along = line.dot(x);
        if (along < common.first_along) common.first = c, common.first_along = along;
        if (along > common.last_along) common.last = c, common.last_along = along;
    }
}

/// For triangles that intersect: a point of both.
Candidate common_point(const Corners& s, const Corners& t) noexcept {
    const Vector3d line = (s[1] - s[0]).cross(s[2] - s[0]).cross((t[1] - t[0]).cross(t[2] - t[0]));
    double size = 0;
    for (const Vector3d& x : {s[1], s[2], t[0], t[1], t[2]})
        size = std::max(size, (x - s[0]).cwiseAbs().maxCoeff());
    CommonSegment common;
    add_piercings(common, s, t, line, true, 1e-10 * size);
    add_piercings(common, t, s, line, false, 1e-10 * size);
    if (common.first_along > common.last_along) return nearest_features(s, t);  // they touch in one plane
    common.first.weights_a = (common.first.weights_a + common.last.weights_a) / 2;
    common.first.weights_b = (common.first.weights_b + common.last.weights_b) / 2;
    return common.first;
}

/// In a frame whose origin is near both, so that nothing is lost far from the world's origin.
Candidate nearest(const Triangle& a, const Triangle& b) noexcept {
    const Vector3d origin = a.a.cast<double>();
    const auto local = [&](const Triangle& t) {
        return Corners{t.a.cast<double>() - origin, t.b.cast<double>() - origin, t.c.cast<double>() - origin};
    };
    if (!triangles_intersect(a, b)) return nearest_features(local(a), local(b));
    Candidate c = common_point(local(a), local(b));
    c.gap.setZero();
    c.squared = 0;
    return c;
}

ClosestPoints closest_points(const Candidate& c, const Corners& a, const Corners& b) noexcept {
    const auto point = [](const Corners& x, const Vector3d& w) -> Vector3d {
        return w[0] * x[0] + w[1] * x[1] + w[2] * x[2];
    };
    return {point(a, c.weights_a), point(b, c.weights_b), c.weights_a, c.weights_b, c.gap,
            std::sqrt(c.squared)};
}

Corners corners(const Triangle& t) noexcept {
    return {t.a.cast<double>(), t.b.cast<double>(), t.c.cast<double>()};
}

}  // namespace

ClosestPoints closest_point_triangle(const Vector3d& p, const Vector3d& u, const Vector3d& v,
                                     const Vector3d& w) noexcept {
    return closest_points(nearest_on_triangle(p, {u, v, w}), {p, p, p}, {u, v, w});
}

ClosestPoints closest_edge_edge(const Vector3d& p, const Vector3d& q, const Vector3d& u,
                                const Vector3d& v) noexcept {
    const Vector3d pq = q - p, uv = v - u;
    Candidate best = between_edges(pq, uv, u - p, 0, 0);
    for (const int end : {0, 1}) {
        const Vector3d from_u = (end ? q : p) - u, from_p = (end ? v : u) - p;
        const double t = project(from_u, uv), s = project(from_p, pq);
        keep_closer(best, candidate(corner(end), on_edge(0, t), from_u - t * uv));
        keep_closer(best, candidate(on_edge(0, s), corner(end), s * pq - from_p));
    }
    return closest_points(best, {p, q, q}, {u, v, v});
}

ClosestPoints closest_triangle_triangle(const Triangle& a, const Triangle& b) noexcept {
    return closest_points(nearest(a, b), corners(a), corners(b));
}

double triangle_distance(const Triangle& a, const Triangle& b) noexcept {
    return std::sqrt(nearest(a, b).squared);
}

}  // namespace nbd
