#include "sim/body_contact.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "collision/closest_points.hpp"

namespace nbd {
namespace {

/// Below this share of `reach` the line between two points is too short to give a direction.
constexpr double direction_share = 1e-3;

/// Edges with a smaller sine between them count as parallel: their vertices make the contact.
constexpr double parallel = 1e-3;

struct NearestFace {
    double distance = std::numeric_limits<double>::infinity();  // signed
    int face = -1;
    Eigen::Vector3d barycentric, normal;
};

NearestFace measure(const ContactSurface& surface, int face, const Eigen::Vector3d& p, double reach) {
    const Faces& F = surface.F();
    const Nodes& x = surface.x();
    const Eigen::Vector3d a = x.row(F(face, 0)), b = x.row(F(face, 1)), c = x.row(F(face, 2));
    const ClosestPoints closest = closest_point_triangle(p, a, b, c);
    const Eigen::Vector3d outward = feature_normal(surface.topology(), F, x, face, closest.weights_b);
    const double sign = closest.gap.dot(outward) < 0 ? -1 : 1;
    const bool far = closest.distance > direction_share * reach;
    return {.distance = sign * closest.distance,
            .face = face,
            .barycentric = closest.weights_b,
            .normal = far ? Eigen::Vector3d(sign * closest.gap / closest.distance) : outward};
}

SurfacePoint vertex_point(int body, int vertex) {
    return {.body = body, .count = 1, .vertices = {vertex}, .weights = {1}};
}

SurfacePoint edge_point(int body, const ContactSurface& surface, int edge, double t) {
    const auto& edges = surface.topology().edges;
    return {.body = body, .count = 2, .vertices = {edges(edge, 0), edges(edge, 1)}, .weights = {1 - t, t}};
}

SurfacePoint face_point(int body, const ContactSurface& surface, int face, const Eigen::Vector3d& w) {
    const auto corners = surface.F().row(face);
    return {.body = body,
            .count = 3,
            .vertices = {corners[0], corners[1], corners[2]},
            .weights = {w[0], w[1], w[2]}};
}

/// Whether segment p q crosses the inside of a face, up to rounding.
bool crosses_face(const ContactSurface& surface, int face, const Eigen::Vector3d& p,
                  const Eigen::Vector3d& q) {
    const auto corners = surface.F().row(face);
    const Eigen::Vector3d a = surface.x().row(corners[0]), b = surface.x().row(corners[1]),
                          c = surface.x().row(corners[2]);
    const Eigen::Vector3d normal = (b - a).cross(c - a), d = q - p;
    if (normal.dot(p - a) * normal.dot(q - a) >= 0) return false;
    const double u = d.dot((a - p).cross(b - p)), v = d.dot((b - p).cross(c - p)),
                 w = d.dot((c - p).cross(a - p));
    return (u > 0 && v > 0 && w > 0) || (u < 0 && v < 0 && w < 0);
}

bool crosses_faces_at(const ContactSurface& surface, int edge, const Eigen::Vector3d& p,
                      const Eigen::Vector3d& q) {
    const auto faces = surface.topology().edge_faces.row(edge);
    return crosses_face(surface, faces[0], p, q) || (faces[1] >= 0 && crosses_face(surface, faces[1], p, q));
}

double edge_area(const ContactSurface& surface, int edge) {
    const auto& edges = surface.topology().edges;
    return (surface.rest_areas()[edges(edge, 0)] + surface.rest_areas()[edges(edge, 1)]) / 6;
}

}  // namespace

void BodyContactFinder::find(const ContactSurface& a, const ContactSurface& b,
                             std::span<const FacePair> pairs, double reach, std::vector<Contact>& contacts) {
    vertex_faces_.clear();
    for (const FacePair& pair : pairs)
        for (int k = 0; k < 3; ++k) vertex_faces_.push_back({a.F()(pair.a, k), pair.b});
    find_vertices(body_a_, a, body_b_, b, reach, sides_a_, contacts);
    vertex_faces_.clear();
    for (const FacePair& pair : pairs)
        for (int k = 0; k < 3; ++k) vertex_faces_.push_back({b.F()(pair.b, k), pair.a});
    find_vertices(body_b_, b, body_a_, a, reach, sides_b_, contacts);
    find_edges(a, b, pairs, reach, contacts);
}

void BodyContactFinder::find_vertices(int body, const ContactSurface& points, int other_body,
                                      const ContactSurface& surface, double reach, Sides& sides,
                                      std::vector<Contact>& contacts) {
    std::ranges::sort(vertex_faces_);
    const auto repeats = std::ranges::unique(vertex_faces_);
    vertex_faces_.erase(repeats.begin(), repeats.end());
    Sides before;
    before.swap(sides);
    auto known = before.cbegin();
    for (std::size_t i = 0; i < vertex_faces_.size();) {
        const int vertex = vertex_faces_[i].vertex;
        known = std::find_if(known, before.cend(), [&](const Side& s) { return s.vertex >= vertex; });
        const bool met = known != before.cend() && known->vertex == vertex;
        const Eigen::Vector3d p = points.x().row(vertex),
                              side = met ? known->normal : Eigen::Vector3d::Zero();
        NearestFace nearest, same_side;
        for (; i < vertex_faces_.size() && vertex_faces_[i].vertex == vertex; ++i) {
            const NearestFace candidate = measure(surface, vertex_faces_[i].face, p, reach);
            const double distance = std::abs(candidate.distance);
            if (distance < std::abs(nearest.distance)) nearest = candidate;
            if (candidate.normal.dot(side) > 0 && distance < std::abs(same_side.distance))
                same_side = candidate;
        }
        if (nearest.distance < 0 && same_side.face >= 0) nearest = same_side;
        if (!(std::abs(nearest.distance) <= reach)) continue;
        sides.push_back({vertex, nearest.normal});
        contacts.push_back({.a = vertex_point(body, vertex),
                            .b = face_point(other_body, surface, nearest.face, nearest.barycentric),
                            .normal = nearest.normal,
                            .gap = nearest.distance,
                            .area = points.rest_areas()[vertex]});
    }
}

void BodyContactFinder::find_edges(const ContactSurface& a, const ContactSurface& b,
                                   std::span<const FacePair> pairs, double reach,
                                   std::vector<Contact>& contacts) {
    edge_pairs_.clear();
    for (const FacePair& pair : pairs)
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j)
                edge_pairs_.push_back(
                    {a.topology().face_edges(pair.a, i), b.topology().face_edges(pair.b, j)});
    std::ranges::sort(edge_pairs_);
    const auto repeats = std::ranges::unique(edge_pairs_);
    edge_pairs_.erase(repeats.begin(), repeats.end());
    for (const FacePair& pair : edge_pairs_) {
        const auto ends_a = a.topology().edges.row(pair.a), ends_b = b.topology().edges.row(pair.b);
        const Eigen::Vector3d a0 = a.x().row(ends_a[0]), a1 = a.x().row(ends_a[1]);
        const Eigen::Vector3d b0 = b.x().row(ends_b[0]), b1 = b.x().row(ends_b[1]);
        if ((a1 - a0).cross(b1 - b0).norm() < parallel * (a1 - a0).norm() * (b1 - b0).norm()) continue;
        const ClosestPoints closest = closest_edge_edge(a0, a1, b0, b1);
        const double s = closest.weights_a[1], t = closest.weights_b[1], length = closest.distance;
        if (length > reach || s <= 0 || s >= 1 || t <= 0 || t >= 1) continue;
        // Apart: each edge lies on the outer side of the other. Overlapping: behind it, and one really passes
        // through the other's faces. Anything else is no contact of these two edges.
        const double above_b = closest.gap.dot(edge_normal(b.topology(), b.F(), b.x(), pair.b));
        const double below_a = -closest.gap.dot(edge_normal(a.topology(), a.F(), a.x(), pair.a));
        const double least = direction_share * length;
        const bool apart = above_b > least && below_a > least;
        const bool overlapping = above_b < -least && below_a < -least &&
                                 (crosses_faces_at(b, pair.b, a0, a1) || crosses_faces_at(a, pair.a, b0, b1));
        if (!apart && !overlapping) continue;
        const double sign = apart ? 1 : -1;
        contacts.push_back({.a = edge_point(body_a_, a, pair.a, s),
                            .b = edge_point(body_b_, b, pair.b, t),

                            .normal = sign * closest.gap / length,
                            .gap = sign * length,
                            .area = std::min(edge_area(a, pair.a), edge_area(b, pair.b))});
    }
}

void BodyContactFinder::save_sides(ContactSides& sides) const {
    const auto save = [&](const Sides& from, int body, int other) {
        for (const Side& side : from) {
            sides.vertices.push_back({body, other, side.vertex});
            sides.normals.push_back(side.normal);
        }
    };
    save(sides_a_, body_a_, body_b_);
    save(sides_b_, body_b_, body_a_);
}

void BodyContactFinder::restore_sides(const ContactSides& sides) {
    const auto restore = [&](int body, int other, Sides& to) {
        to.clear();
        for (std::size_t i = 0; i < sides.vertices.size(); ++i)
            if (sides.vertices[i][0] == body && sides.vertices[i][1] == other)
                to.push_back({sides.vertices[i][2], sides.normals[i]});
        std::ranges::sort(to, {}, &Side::vertex);
    };
    restore(body_a_, body_b_, sides_a_);
    restore(body_b_, body_a_, sides_b_);
}

void find_obstacle_contacts(int body, const ContactSurface& surface, const Obstacle& obstacle, double time,
                            double reach, std::vector<Contact>& contacts) {
    for (int v = 0; v < surface.vertex_count(); ++v) {
        const auto hit = signed_distance(obstacle, surface.x().row(v).transpose(), time, reach);
        if (!hit || hit->distance > reach) continue;
        contacts.push_back({.a = vertex_point(body, v),
                            .normal = hit->normal,
                            .wall_velocity = obstacle.velocity,
                            .gap = hit->distance,
                            .area = surface.rest_areas()[v],
                            .friction = obstacle.friction});
    }
}

}  // namespace nbd
