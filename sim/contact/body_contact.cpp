#include "sim/contact/body_contact.hpp"

#include <algorithm>
#include <limits>

#include "collision/geometry/closest_points.hpp"
#include "collision/geometry/separation.hpp"
#include "sim/contact/edge_contact.hpp"

namespace nbd {
namespace {

struct NearestFace {
    double distance = std::numeric_limits<double>::infinity();  // signed
    int face = -1;
    Eigen::Vector3d barycentric, normal;
};

NearestFace measure(const ContactSurface& surface, int face, const Eigen::Vector3d& p, double reach) {
    /// At smaller shares of `reach` the line between two points is too short to give a direction.
    constexpr double direction_share = 1e-3;
    const Faces& F = surface.F();
    const Nodes& x = surface.x();
    const ClosestPoints closest =
        closest_point_triangle(p, x.row(F(face, 0)), x.row(F(face, 1)), x.row(F(face, 2)));
    const Eigen::Vector3d outward = feature_normal(surface.topology(), F, x, face, closest.weights_b);
    const double sign = closest.gap.dot(outward) < 0 ? -1 : 1;
    const bool far = closest.distance > direction_share * reach;
    return {.distance = sign * closest.distance,
            .face = face,
            .barycentric = closest.weights_b,
            .normal = far ? Eigen::Vector3d(sign * closest.gap / closest.distance) : outward};
}

NearestFace nearest_of(const ContactSurface& surface, std::span<const int> faces, const Eigen::Vector3d& p,
                       double reach) {
    const Faces& F = surface.F();
    const Nodes& x = surface.x();
    double least = std::numeric_limits<double>::infinity();
    int nearest = -1;
    for (const int f : faces) {
        const double distance =
            closest_point_triangle(p, x.row(F(f, 0)), x.row(F(f, 1)), x.row(F(f, 2))).distance;
        if (!(distance < least)) continue;
        least = distance;
        nearest = f;
    }
    return least <= reach ? measure(surface, nearest, p, reach) : NearestFace{};
}

/// The nearest of the faces whose normal at their nearest point has the same side as `side`.
NearestFace nearest_on_side(const ContactSurface& surface, std::span<const int> faces,
                            const Eigen::Vector3d& p, const Eigen::Vector3d& side, double reach) {
    NearestFace nearest;
    for (const int f : faces) {
        const NearestFace candidate = measure(surface, f, p, reach);
        if (candidate.normal.dot(side) > 0 && std::abs(candidate.distance) < std::abs(nearest.distance))
            nearest = candidate;
    }
    return nearest;
}

SurfacePoint face_point(int body, const ContactSurface& surface, int face, const Eigen::Vector3d& w) {
    const auto corners = surface.F().row(face);
    return {.body = body,
            .count = 3,
            .vertices = {corners[0], corners[1], corners[2]},
            .weights = {w[0], w[1], w[2]}};
}

Box point_box(const ContactSurface& surface, int vertex) {
    const Eigen::Vector3f p = surface.x_float().row(vertex);
    return bounding_box({p, p, p});
}

}  // namespace

void BodyContactFinder::find(const ContactSurface& a, const ContactSurface& b,
                             std::span<const FacePair> pairs, const ContactReach& reach, double moved,
                             std::vector<Contact>& contacts) {
    find_vertices(body_a_, a, body_b_, b, pairs, reach, moved, sides_a_, contacts);
    flipped_.clear();
    for (const FacePair& pair : pairs) flipped_.push_back({pair.b, pair.a});
    std::ranges::sort(flipped_);
    find_vertices(body_b_, b, body_a_, a, flipped_, reach, moved, sides_b_, contacts);
    find_edge_contacts({body_a_, a}, {body_b_, b}, pairs, reach, contacts);
}

/// pairs: sorted; pair.a is a face of `points`.
void BodyContactFinder::find_vertices(int body, const ContactSurface& points, int other_body,
                                      const ContactSurface& surface, std::span<const FacePair> pairs,
                                      const ContactReach& reach, double moved, Sides& sides,
                                      std::vector<Contact>& contacts) {
    const auto most = static_cast<float>(reach.most());
    Sides now;
    for (std::size_t begin = 0, end = 0; begin < pairs.size(); begin = end) {
        const int own = pairs[begin].a;
        while (end < pairs.size() && pairs[end].a == own) ++end;
        for (int k = 0; k < 3; ++k) {
            const int vertex = points.F()(own, k);
            if (!points.topology().owns_vertex(own, vertex)) continue;
            const Box box = point_box(points, vertex);
            near_faces_.clear();
            for (const FacePair& pair : pairs.subspan(begin, end - begin))
                if (!apart(box, surface.face_box(pair.b), most)) near_faces_.push_back(pair.b);
            const Eigen::Vector3d p = points.x().row(vertex);
            NearestFace nearest = nearest_of(surface, near_faces_, p, reach.most());
            double inside = moved;
            if (nearest.distance < 0) {
                const auto known = std::ranges::lower_bound(sides, vertex, {}, &Side::vertex);
                if (known != sides.end() && known->vertex == vertex) {
                    inside += known->depth;
                    if (nearest.normal.dot(known->normal) <= 0)
                        if (const NearestFace other =
                                nearest_on_side(surface, near_faces_, p, known->normal, reach.most());
                            other.face >= 0)
                            nearest = other;
                }
            }
            if (!(nearest.distance <= reach.apart && -nearest.distance <= std::min(inside, reach.inside)))
                continue;
            now.push_back({vertex, nearest.normal, std::max(0.0, -nearest.distance)});
            contacts.push_back({.a = {.body = body, .count = 1, .vertices = {vertex}, .weights = {1}},
                                .b = face_point(other_body, surface, nearest.face, nearest.barycentric),
                                .normal = nearest.normal,
                                .gap = nearest.distance,
                                .area = points.rest_areas()[vertex]});
        }
    }
    std::ranges::sort(now, {}, &Side::vertex);
    sides.swap(now);
}

double BodyContactFinder::deepest() const noexcept {
    double deepest = 0;
    for (const Sides* sides : {&sides_a_, &sides_b_})
        for (const Side& side : *sides) deepest = std::max(deepest, side.depth);
    return deepest;
}

void BodyContactFinder::save_sides(ContactSides& sides) const {
    const auto save = [&](const Sides& from, int body, int other) {
        for (const Side& side : from) {
            sides.vertices.push_back({body, other, side.vertex});
            sides.normals.push_back(side.normal);
            sides.depths.push_back(side.depth);
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
                to.push_back({sides.vertices[i][2], sides.normals[i], sides.depths[i]});
        std::ranges::sort(to, {}, &Side::vertex);
    };
    restore(body_a_, body_b_, sides_a_);
    restore(body_b_, body_a_, sides_b_);
}

}  // namespace nbd
