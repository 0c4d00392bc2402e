#include "sim/contact/body_contact.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "collision/geometry/closest_points.hpp"
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

/// Finds the nearest face in reach among those of some patches of a surface, for the vertices of one patch of
/// another after the other.
class NearestSearch {
 public:
    NearestSearch(const PosedPatches& points, const PosedPatches& others, const ContactReach& reach)
        : points_(points),
          others_(others),
          reach_(reach),
          slack_(16 * (points.tolerance() + others.tolerance())) {}

    /// Begins the search for the vertices of a patch. pairs: this patch, and those of the faces; at least
    /// one.
    void begin_patch(std::span<const PatchPair> pairs) { pairs_ = pairs; }

    /// How far a vertex and a face may approach each other in the step, at most, metres.
    double approach(int vertex, int face) const {
        const Eigen::Vector3f own = points_.motion(vertex);
        float most = 0;
        for (const int corner : others_.surface().F().row(face))
            most = std::max(most, (own - others_.motion(corner)).norm());
        return std::min(reach_.approach, double{most});
    }

    /// face is -1 if there is none.
    NearestFace nearest(int vertex) {
        const std::array<float, 3> q = points_.position(vertex);
        const Eigen::Vector3f& motion = points_.motion(vertex);
        const auto least = static_cast<float>(reach_.least()), approach = static_cast<float>(reach_.approach);
        near_.clear();
        candidates_.clear();
        most_ = std::numeric_limits<float>::infinity();
        for (const PatchPair& pair : pairs_) {
            const PosedPatch& posed = others_[pair.b];
            const float reach = least + std::min(approach, relative_motion(motion, posed)) + slack_;
            if (posed.squared_distance_to_box(q) > reach * reach) continue;
            const float distance = posed.distance_to_centres(q);
            if (distance - posed.radius > reach) continue;
            near_.push_back({distance - posed.radius, reach, pair.b});
            // A face that is certainly in reach ends the search for those that are certainly farther away.
            const float most = distance + posed.radius + slack_;
            if (most <= least) most_ = std::min(most_, most);
        }
        for (const NearPatch& patch : near_)
            if (patch.distance <= most_ + slack_) visit(patch, vertex, q);
        return measured(vertex);
    }

    /// The nearest face in reach whose normal at its nearest point has the same side as `side`.
    NearestFace nearest_on_side(int vertex, const Eigen::Vector3d& side) const {
        const ContactSurface& surface = others_.surface();
        const Eigen::Vector3d p = points_.surface().x(vertex);
        NearestFace nearest;
        for (const PatchPair& pair : pairs_)
            for (const int face : surface.patches().faces[pair.b]) {
                const NearestFace candidate = measure(surface, face, p, reach_.most());
                const double distance = std::abs(candidate.distance), least = std::abs(nearest.distance);
                if (candidate.normal.dot(side) > 0 && in_reach(vertex, face, distance) &&
                    (distance < least || (distance == least && face < nearest.face)))
                    nearest = candidate;
            }
        return nearest;
    }

 private:
    /// A patch that may have the nearest face: how near it is at least, and the maximum reach of its faces.
    struct NearPatch {
        float distance, reach;
        int patch;
    };

    /// Of a distance, with what rounding may add.
    float squared(float distance) const noexcept { return (distance + slack_) * (distance + slack_); }

    bool in_reach(int vertex, int face, double distance) const {
        return distance <= reach_.least() ||
               (distance <= reach_.most() && distance <= reach_.least() + approach(vertex, face));
    }

    void visit(const NearPatch& near, int vertex, const std::array<float, 3>& q) {
        const PosedPatch& posed = others_[near.patch];
        const float most = squared(std::min(most_, near.reach)),
                    closest = posed.squared_distances(q, squared_);
        if (!(closest <= most) && posed.slivers == 0) return;
        const auto faces = others_.surface().patches().faces[near.patch];
        for (std::size_t i = 0; i < faces.size(); ++i) {
            const bool sliver = posed.slivers >> i & 1;
            if (sliver || squared_[i] <= most) candidates_.push_back({sliver ? 0 : squared_[i], faces[i]});
            if (squared_[i] == closest && in_reach(vertex, faces[i], std::sqrt(closest) + slack_))
                most_ = std::min(most_, std::sqrt(closest) + slack_);
        }
    }

    NearestFace measured(int vertex) {
        // The likeliest first: it rules out most others.
        if (!candidates_.empty())
            std::swap(candidates_.front(), *std::ranges::min_element(candidates_, {}, &Candidate::squared));
        const ContactSurface& surface = others_.surface();
        const Eigen::Vector3d p = points_.surface().x(vertex);
        double least = std::numeric_limits<double>::infinity();
        float most = squared(most_);
        int nearest = -1;
        for (const Candidate& candidate : candidates_) {
            if (!(candidate.squared <= most)) continue;
            const int face = candidate.face;
            if (!in_reach(vertex, face, std::sqrt(candidate.squared) - slack_)) continue;
            const double distance = closest_point(surface, face, p).distance;
            if ((distance < least || (distance == least && face < nearest)) &&
                in_reach(vertex, face, distance)) {
                least = distance;
                nearest = face;
                most = std::min(most, squared(static_cast<float>(distance)));
            }
        }
        return nearest < 0 ? NearestFace{} : measure(surface, nearest, p, reach_.most());
    }

    const PosedPatches &points_, &others_;
    std::span<const PatchPair> pairs_;
    const ContactReach& reach_;
    float slack_, most_ = 0;  // most_: the nearest face in reach is no farther
    std::vector<NearPatch> near_;
    PatchLanes squared_;
    std::vector<Candidate> candidates_;
};

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
    for (const PatchPair& pair : pairs) {
        a.require(pair.a);
        b.require(pair.b);
    }
    near_.clear();
    flipped_.clear();
    const float room = 8 * (a.tolerance() + b.tolerance());
    for (const PatchPair& pair : pairs) {
        const PosedPatch &s = a[pair.a], &t = b[pair.b];
        const float most =
            static_cast<float>(reach.least() + std::min(reach.approach, double{relative_motion(s, t)})) +
            room;
        if (squared_distance(s, t) > most * most) continue;
        near_.push_back(pair);
        flipped_.push_back({pair.b, pair.a});
    }
    std::ranges::sort(flipped_);
    find_vertices(body_a_, a, body_b_, b, near_, reach, moved, sides_a_, contacts);
    find_vertices(body_b_, b, body_a_, a, flipped_, reach, moved, sides_b_, contacts);
    find_edge_contacts({body_a_, a}, {body_b_, b}, near_, reach, contacts);
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
    NearestSearch search(points, others, reach);
    for (std::size_t begin = 0, end = 0; begin < pairs.size(); begin = end) {
        const int patch = pairs[begin].a;
        while (end < pairs.size() && pairs[end].a == patch) ++end;
        search.begin_patch(pairs.subspan(begin, end - begin));
        for (const int vertex : own.patches().vertices[patch]) {
            NearestFace nearest = search.nearest(vertex);
            if (nearest.face < 0) continue;
            double inside = moved;
            if (nearest.distance < 0) {
                const auto known = std::ranges::lower_bound(sides, vertex, {}, &Side::vertex);
                if (known != sides.end() && known->vertex == vertex) {
                    inside += known->depth;
                    if (nearest.normal.dot(known->normal) <= 0)
                        if (const NearestFace other = search.nearest_on_side(vertex, known->normal);
                            other.face >= 0)
                            nearest = other;
                }
            }
            const double most = nearest.distance < 0 ? reach.inside : reach.apart,
                         distance = std::abs(nearest.distance);
            if ((distance <= most || distance <= most + search.approach(vertex, nearest.face)) &&
                -nearest.distance <= inside)
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
