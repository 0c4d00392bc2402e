// What touches at the start where something holds it, and so does not press.
#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <span>
#include <utility>
#include <vector>

#include "collision/query/pair_query.hpp"
#include "sim/barrier/barrier.hpp"

namespace nbd {
namespace {

/// Of the closest point of two features on what is not held, as rounding leaves it.
constexpr double most_free_weight = 1e-3;

/// The faces that have all of these vertices.
std::vector<int> faces_with(const SurfaceTopology& topology, std::initializer_list<int> vertices) {
    std::vector<int> faces;
    for (const int vertex : vertices) {
        const std::size_t v = vertex;
        const std::vector<int> others(topology.vertex_faces.begin() + topology.vertex_begin[v],
                                      topology.vertex_faces.begin() + topology.vertex_begin[v + 1]);
        if (vertex == *vertices.begin())
            faces = others;
        else
            std::erase_if(faces, [&](int f) { return !std::ranges::binary_search(others, f); });
    }
    return faces;
}

std::vector<int> faces_of_edge(const SurfaceTopology& topology, int edge) {
    return faces_with(topology, {topology.edges(edge, 0), topology.edges(edge, 1)});
}

}  // namespace

/// Finds what touches in the poses in which held bodies were added, with obstacles at time 0.
void Barrier::find_held_touch() {
    for (Wall& wall : walls_) wall.held_touch.clear();
    search_.leave_out({});
    if (std::ranges::all_of(bodies_, [](const Body& body) { return body.held.nodes.size() == 0; })) return;
    begin_step(0, 0);
    std::vector<Nodes> nodes;
    for (std::size_t b = 0; b < bodies_.size(); ++b)
        nodes.push_back(bodies_[b].held.nodes.size() > 0 ? bodies_[b].held.nodes : surfaces_[b].rest_nodes());
    place(nodes, nodes, 0);
    find_held_on_smooth();
    std::vector<FeaturePair> features;
    std::vector<Intersection> faces;
    for (int a = 0; a < std::ssize(surfaces_); ++a)
        for (int b = a + 1; b < std::ssize(surfaces_); ++b) find_held_pairs(a, b, features, faces);
    search_.leave_out(std::move(features));
    intersection_search_.leave_out(std::move(faces));
}

/// Vertices on planes and balls count as far from these as where they begin to press.
void Barrier::find_held_on_smooth() {
    for (std::size_t w = 0; w < walls_.size(); ++w) {
        if (!walls_[w].smooth) continue;
        for (int b = 0; b < std::ssize(bodies_); ++b) {
            if (!rules_.meet(b, party_of_obstacle(w))) continue;
            const std::vector<char>& held = bodies_[b].held.held;
            for (int v = 0; v < std::ssize(held); ++v) {
                if (!held[v]) continue;
                const double from = distance(NearSmooth{b, v, static_cast<int>(w)}, 0).distance;
                if (from >= -touching_share * reach_ && from < reach_)
                    walls_[w].held_touch[{b, v}] = reach_ - from;
            }
        }
    }
}

/// Appends the features of two surfaces that touch where both stay for ever, and the faces with such
/// features.
void Barrier::find_held_pairs(int a, int b, std::vector<FeaturePair>& features,
                              std::vector<Intersection>& faces) {
    MovingSurface &s = surfaces_[a], &t = surfaces_[b];
    const auto stays = [&](const MovingSurface& surface) {
        if (const Wall* wall = wall_of(surface)) return wall->obstacle.stands();
        return std::ranges::count(bodies_[surface.body()].held.stays, 0) <
               std::ssize(bodies_[surface.body()].held.stays);
    };
    if (!rules_.meet(s.body(), t.body()) || !stays(s) || !stays(t)) return;
    const auto near = static_cast<float>(touching_share * reach_ + s.rounding() + t.rounding());
    const std::size_t first = features.size();
    PairQuery query;
    for (const FacePair& pair : query.boxes_within(s.still_tree(), t.still_tree(), near))
        for_each_owned_pair(s.numbered(a), t.numbered(b), pair,
                            [&](const FeaturePair& one, const PlacesInFaces&) {
                                if (touches_where_held(one)) features.push_back(one);
                            });
    for (const FeaturePair& pair : std::span(features).subspan(first)) {
        const SurfaceTopology &of_a = surfaces_[pair.surface_a].topology(),
                              &of_b = surfaces_[pair.surface_b].topology();
        const bool is_edges = pair.kind == FeatureKind::edge_edge;
        for (const int f : is_edges ? faces_of_edge(of_a, pair.a) : faces_with(of_a, {pair.a}))
            for (const int g : is_edges ? faces_of_edge(of_b, pair.b) : std::vector<int>{pair.b})
                faces.push_back(pair.surface_a < pair.surface_b
                                    ? Intersection{pair.surface_a, pair.surface_b, f, g}
                                    : Intersection{pair.surface_b, pair.surface_a, g, f});
        if (const Wall* wall = wall_of(surfaces_[pair.surface_b]); wall && !is_edges)
            walls_[wall - walls_.data()].held_touch[{surfaces_[pair.surface_a].body(), pair.a}] = 0;
    }
}

/// Whether the features touch at points that stay.
bool Barrier::touches_where_held(const FeaturePair& pair) const {
    const ClosestPoints closest = closest_points(pair.kind, positions(pair, 0));
    if (closest.distance > touching_share * reach_) return false;
    const auto at = corners(pair, surfaces_);
    const std::size_t of_a = corners_of_a(pair.kind);
    for (std::size_t k = 0; k < 4; ++k) {
        const MovingSurface& surface = surfaces_[at[k].surface];
        const double weight = k < of_a ? closest.weights_a[k] : closest.weights_b[k - of_a];
        if (!surface.is_obstacle() && weight > most_free_weight &&
            !bodies_[surface.body()].held.stays[at[k].vertex])
            return false;
    }
    return true;
}

bool Barrier::may_touch(int body, int vertex, int obstacle) const {
    return walls_[obstacle].held_touch.contains({body, vertex});
}

}  // namespace nbd
