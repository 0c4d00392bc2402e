#include "sim/contact/body_contact.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/contact/contact_vertices.hpp"
#include "sim/contact/edge_contact.hpp"
#include "sim/contact/nearest_face.hpp"

namespace nbd {
namespace {

SurfacePoint face_point(int body, const ContactSurface& surface, int face, const Eigen::Vector3d& w) {
    const auto corners = surface.F().row(face);
    return {.body = body,
            .count = 3,
            .vertices = {corners[0], corners[1], corners[2]},
            .weights = {w[0], w[1], w[2]}};
}

/// The pairs of each patch pair.a. pairs: sorted.
std::vector<std::span<const PatchPair>> by_first(std::span<const PatchPair> pairs) {
    std::vector<std::span<const PatchPair>> groups;
    for (std::size_t begin = 0, end = 0; begin < pairs.size(); begin = end) {
        while (end < pairs.size() && pairs[end].a == pairs[begin].a) ++end;
        groups.push_back(pairs.subspan(begin, end - begin));
    }
    return groups;
}

}  // namespace

long BodyContactFinder::find(PosedPatches& a, PosedPatches& b, std::span<const PatchPair> pairs,
                             const ContactReach& reach, ContactDetail detail, double moved,
                             std::vector<Contact>& contacts) {
    a.require(pairs, &PatchPair::a);
    b.require(pairs, &PatchPair::b);
    near_.clear();
    flipped_.clear();
    const float room = 8 * (a.tolerance() + b.tolerance()),
                farthest = static_cast<float>(reach.most()) + room;
    for (const PatchPair& pair : pairs) {
        const PatchBounds &s = a.bounds(pair.a), &t = b.bounds(pair.b);
        const float squared = squared_distance(s, t);
        if (squared > farthest * farthest) continue;  // most pairs
        const float most =
            static_cast<float>(reach.least() + std::min(reach.approach, double{relative_motion(s, t)})) +
            room;
        if (squared > most * most) continue;
        near_.push_back(pair);
        flipped_.push_back({pair.b, pair.a});
    }
    counting_sort_.sort(flipped_, b.surface().patches().count(),
                        [](const PatchPair& pair) { return pair.a; });
    long measured = find_vertices(body_a_, a, body_b_, b, near_, reach, detail, moved, sides_a_, contacts);
    measured += find_vertices(body_b_, b, body_a_, a, flipped_, reach, detail, moved, sides_b_, contacts);
    measured += find_edge_contacts({body_a_, a}, {body_b_, b}, near_, reach, detail, contacts);
    return measured;
}

/// pairs: sorted; pair.a is a patch of `points`.
long BodyContactFinder::find_vertices(int body, const PosedPatches& points, int other_body,
                                      const PosedPatches& others, std::span<const PatchPair> pairs,
                                      const ContactReach& reach, ContactDetail detail, double moved,
                                      VertexSides& sides, std::vector<Contact>& contacts) {
    const ContactSurface &own = points.surface(), &surface = others.surface();
    const ContactVertices vertices = contact_vertices(own, detail);
    const std::vector<std::span<const PatchPair>> groups = by_first(pairs);
    std::vector<SoughtVertex> sought;
    for (std::size_t g = 0; g < groups.size(); ++g)
        for (const int vertex : vertices.of_patch[groups[g].front().a]) sought.push_back({vertex, g});
    // Threads find the nearest faces; their normals, which positions around them are computed for, follow.
    const NearestFaces nearest_face = nearest_faces(points, others, groups, reach, sought);
    const std::vector<int>& faces = nearest_face.of_vertices;
    struct Hit {
        int vertex;
        NearestFace nearest;
    };
    std::vector<Hit> hits;
    for (std::size_t i = 0; i < sought.size(); ++i) {
        if (faces[i] < 0) continue;
        const auto& [vertex, group] = sought[i];
        NearestFace nearest = measure(surface, faces[i], own.x(vertex), reach.most());
        double inside = moved;
        if (nearest.distance < 0) {
            const auto known = std::ranges::lower_bound(sides, vertex, {}, &VertexSide::vertex);
            if (known != sides.end() && known->vertex == vertex) {
                inside += known->depth;
                if (nearest.normal.dot(known->normal) <= 0)
                    if (const NearestFace other =
                            nearest_on_side(points, vertex, others, groups[group], reach, known->normal);
                        other.face >= 0)
                        nearest = other;
            }
        }
        const double most = nearest.distance < 0 ? reach.inside : reach.apart,
                     distance = std::abs(nearest.distance);
        if ((distance <= most || distance <= most + approach(points, vertex, others, nearest.face, reach)) &&
            -nearest.distance <= inside)
            hits.push_back({vertex, nearest});
    }
    std::ranges::sort(hits, {}, &Hit::vertex);
    sides.clear();
    for (const auto& [vertex, nearest] : hits) {
        sides.push_back({vertex, nearest.normal, std::max(0.0, -nearest.distance)});
        contacts.push_back({.a = {.body = body, .count = 1, .vertices = {vertex}, .weights = {1}},
                            .b = face_point(other_body, surface, nearest.face, nearest.barycentric),
                            .normal = nearest.normal,
                            .gap = nearest.distance,
                            .area = vertices.areas[vertex]});
    }
    return nearest_face.measured;
}

double BodyContactFinder::deepest() const noexcept {
    return std::max(nbd::deepest(sides_a_), nbd::deepest(sides_b_));
}

void BodyContactFinder::save_sides(ContactSides& sides) const {
    append(sides_a_, body_a_, body_b_, sides);
    append(sides_b_, body_b_, body_a_, sides);
}

void BodyContactFinder::restore_sides(const ContactSides& sides) {
    sides_a_ = sides_of(sides, body_a_, body_b_);
    sides_b_ = sides_of(sides, body_b_, body_a_);
}

}  // namespace nbd
