#include "sim/contact/body_contact.hpp"

#include <algorithm>
#include <array>
#include <cmath>
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

ClosestPoints closest_point(const ContactSurface& surface, int face, const Eigen::Vector3d& p) {
    const auto corners = surface.F().row(face);
    return closest_point_triangle(p, surface.x(corners[0]), surface.x(corners[1]), surface.x(corners[2]));
}

NearestFace measure(const ContactSurface& surface, int face, const Eigen::Vector3d& p, double reach) {
    /// At smaller shares of `reach` the line between two points is too short to give a direction.
    constexpr double direction_share = 1e-3;
    const ClosestPoints closest = closest_point(surface, face, p);
    const Eigen::Vector3d outward = surface.feature_normal(face, closest.weights_b);
    const double sign = closest.gap.dot(outward) < 0 ? -1 : 1;
    const bool far = closest.distance > direction_share * reach;
    return {.distance = sign * closest.distance,
            .face = face,
            .barycentric = closest.weights_b,
            .normal = far ? Eigen::Vector3d(sign * closest.gap / closest.distance) : outward};
}

/// A face and the squared distance to it in single precision.
struct Candidate {
    float squared;
    int face;
};

/// Finds the nearest face of some patches to a point.
class NearestSearch {
 public:
    /// others: of patches; patches: their places.
    NearestSearch(const PosedPatches& others, std::span<const PatchPair> pairs, float tolerance)
        : others_(others), pairs_(pairs), slack_(16 * tolerance) {}

    /// The nearest face within reach of a point: p in double precision, q in single precision relative to the
    /// origin of the patches. face is -1 if there is none.
    NearestFace nearest(const Eigen::Vector3d& p, const std::array<float, 3>& q, double reach) {
        candidates_.clear();
        allow(static_cast<float>(reach));
        boxes_.clear();
        std::size_t first = 0;
        for (std::size_t k = 0; k < pairs_.size(); ++k) {
            boxes_.push_back(others_[pairs_[k].b].squared_distance_to_box(q));
            if (boxes_[k] < boxes_[first]) first = k;
        }
        least_ = most_;
        if (!(boxes_[first] <= most_)) return {};
        visit(first, q);
        for (std::size_t k = 0; k < pairs_.size(); ++k)
            if (k != first && boxes_[k] <= most_) visit(k, q);
        return measured(p, reach);
    }

 private:
    /// Candidates are within `distance`, and what rounding may add.
    void allow(float distance) noexcept { most_ = (distance + slack_) * (distance + slack_); }

    void visit(std::size_t k, const std::array<float, 3>& q) {
        const int patch = pairs_[k].b;
        const PosedPatch& posed = others_[patch];
        const float closest = posed.squared_distances(q, squared_);
        if (!(closest <= most_) && posed.slivers == 0) return;
        if (closest < least_) {
            least_ = closest;
            allow(std::sqrt(closest));
        }
        const auto faces = others_.surface().patches().faces[patch];
        for (std::size_t i = 0; i < faces.size(); ++i) {
            const bool sliver = posed.slivers >> i & 1;
            if (sliver || squared_[i] <= most_) candidates_.push_back({sliver ? 0 : squared_[i], faces[i]});
        }
    }

    NearestFace measured(const Eigen::Vector3d& p, double reach) const {
        const ContactSurface& surface = others_.surface();
        double least = std::numeric_limits<double>::infinity();
        int nearest = -1;
        for (const Candidate& candidate : candidates_) {
            if (!(candidate.squared <= most_)) continue;
            const double distance = closest_point(surface, candidate.face, p).distance;
            if (distance < least || (distance == least && candidate.face < nearest)) {
                least = distance;
                nearest = candidate.face;
            }
        }
        return least <= reach ? measure(surface, nearest, p, reach) : NearestFace{};
    }

    const PosedPatches& others_;
    std::span<const PatchPair> pairs_;
    float slack_, most_ = 0, least_ = 0;  // most_, least_: squared
    PatchLanes squared_;
    std::vector<float> boxes_;  // squared distances
    std::vector<Candidate> candidates_;
};

/// The nearest of the faces of some patches whose normal at their nearest point has the same side as `side`,
/// among those whose boxes are within reach.
NearestFace nearest_on_side(const ContactSurface& surface, std::span<const PatchPair> pairs,
                            const Eigen::Vector3d& p, const Eigen::Vector3d& side, double reach) {
    const Eigen::Vector3f q = p.cast<float>();
    const Box box = bounding_box({q, q, q});
    std::vector<int> faces;
    for (const PatchPair& pair : pairs)
        for (const int face : surface.patches().faces[pair.b])
            if (!apart(box, surface.face_box(face), static_cast<float>(reach))) faces.push_back(face);
    std::ranges::sort(faces);
    NearestFace nearest;
    for (const int face : faces) {
        const NearestFace candidate = measure(surface, face, p, reach);
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

}  // namespace

void BodyContactFinder::find(PosedPatches& a, PosedPatches& b, std::span<const PatchPair> pairs,
                             const ContactReach& reach, double moved, std::vector<Contact>& contacts) {
    flipped_.clear();
    for (const PatchPair& pair : pairs) {
        a.require(pair.a);
        b.require(pair.b);
        flipped_.push_back({pair.b, pair.a});
    }
    std::ranges::sort(flipped_);
    find_vertices(body_a_, a, body_b_, b, pairs, reach, moved, sides_a_, contacts);
    find_vertices(body_b_, b, body_a_, a, flipped_, reach, moved, sides_b_, contacts);
    find_edge_contacts({body_a_, a}, {body_b_, b}, pairs, reach, contacts);
}

/// pairs: sorted; pair.a is a patch of `points`.
void BodyContactFinder::find_vertices(int body, const PosedPatches& points, int other_body,
                                      const PosedPatches& others, std::span<const PatchPair> pairs,
                                      const ContactReach& reach, double moved, Sides& sides,
                                      std::vector<Contact>& contacts) {
    const ContactSurface &own = points.surface(), &surface = others.surface();
    struct Hit {
        int vertex;
        NearestFace nearest;
    };
    std::vector<Hit> hits;
    for (std::size_t begin = 0, end = 0; begin < pairs.size(); begin = end) {
        const int patch = pairs[begin].a;
        while (end < pairs.size() && pairs[end].a == patch) ++end;
        const auto near = pairs.subspan(begin, end - begin);
        NearestSearch search(others, near, points.tolerance() + others.tolerance());
        for (const int vertex : own.patches().vertices[patch]) {
            const Eigen::Vector3d p = own.x(vertex);
            NearestFace nearest = search.nearest(p, points.position(vertex), reach.most());
            double inside = moved;
            if (nearest.distance < 0) {
                const auto known = std::ranges::lower_bound(sides, vertex, {}, &Side::vertex);
                if (known != sides.end() && known->vertex == vertex) {
                    inside += known->depth;
                    if (nearest.normal.dot(known->normal) <= 0)
                        if (const NearestFace other =
                                nearest_on_side(surface, near, p, known->normal, reach.most());
                            other.face >= 0)
                            nearest = other;
                }
            }
            if (nearest.distance <= reach.apart && -nearest.distance <= std::min(inside, reach.inside))
                hits.push_back({vertex, nearest});
        }
    }
    std::ranges::sort(hits, {}, &Hit::vertex);
    sides.clear();
    for (const auto& [vertex, nearest] : hits) {
        sides.push_back({vertex, nearest.normal, std::max(0.0, -nearest.distance)});
        contacts.push_back({.a = {.body = body, .count = 1, .vertices = {vertex}, .weights = {1}},
                            .b = face_point(other_body, surface, nearest.face, nearest.barycentric),
                            .normal = nearest.normal,
                            .gap = nearest.distance,
                            .area = own.rest_areas()[vertex]});
    }
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
