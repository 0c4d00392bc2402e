#include "apps/extras/contact_edges.hpp"

#include <algorithm>
#include <utility>

namespace nbd {

ContactEdgeSurface::ContactEdgeSurface(std::shared_ptr<const CollisionTree> of_surface,
                                       SurfaceEmbedding weights, VerticesRef rest,
                                       const ContactDistances& in_double)
    : tree(std::move(of_surface)),
      W(std::move(weights)),
      distances{static_cast<float>(in_double.bodies), static_cast<float>(in_double.self)},
      near_at_rest(nbd::near_at_rest(rest, tree->faces, static_cast<float>(2 * distances.self))) {}

ContactEdgeFinder::ContactEdgeFinder(std::vector<std::shared_ptr<const ContactEdgeSurface>> surfaces,
                                     std::vector<int> ids, std::vector<Obstacle> obstacles)
    : surfaces_(std::move(surfaces)),
      ids_(std::move(ids)),
      obstacles_(std::move(obstacles)),
      x_(surfaces_.size()) {
    for (const auto& surface : surfaces_) {
        posed_.emplace_back(surface->tree, BoundKind::boxes);
        self_.emplace_back(surface->near_at_rest);
    }
}

std::vector<std::vector<ContactEdge>> ContactEdgeFinder::find(std::span<const Vertices> nodes, double time) {
    for (std::size_t b = 0; b < surfaces_.size(); ++b) {
        apply_embedding(surfaces_[b]->W, nodes[b], x_[b]);
        posed_[b].begin_pose(x_[b]);
    }
    std::vector<std::vector<ContactEdge>> edges(surfaces_.size());
    for (std::size_t a = 0; a < surfaces_.size(); ++a) {
        const float distance = surfaces_[a]->distances.bodies;
        for (std::size_t b = a + 1; b < surfaces_.size(); ++b) {
            if (ids_[a] == unrecorded_partner && ids_[b] == unrecorded_partner) continue;
            for (const FacePair& pair : query_.within(posed_[a], posed_[b], distance)) {
                edges[a].push_back({pair.a, ids_[b], pair.b});
                edges[b].push_back({pair.b, ids_[a], pair.a});
            }
        }
        if (ids_[a] == unrecorded_partner) continue;
        for (const FacePair& pair :
             self_[a].within(posed_[a], static_cast<float>(surfaces_[a]->distances.self)))
            edges[a].push_back({pair.a, ids_[a], pair.b});
        meet_obstacles(a, time, edges[a]);
    }
    for (std::size_t b = 0; b < surfaces_.size(); ++b) {
        if (ids_[b] == unrecorded_partner) edges[b].clear();
        std::ranges::sort(edges[b]);
    }
    return edges;
}

void ContactEdgeFinder::meet_obstacles(std::size_t body, double time, std::vector<ContactEdge>& edges) const {
    const Faces& F = surfaces_[body]->tree->faces;
    const double reach = surfaces_[body]->distances.bodies;
    for (std::size_t k = 0; k < obstacles_.size(); ++k) {
        std::vector<bool> touches(x_[body].rows());
        const Obstacle now = as_at(obstacles_[k], time);
        for (Eigen::Index v = 0; v < x_[body].rows(); ++v) {
            const auto found = signed_distance(now, x_[body].row(v).transpose().cast<double>(), time, reach);
            touches[v] = found && found->distance <= reach;
        }
        for (int f = 0; f < F.rows(); ++f)
            if (std::ranges::any_of(F.row(f), [&](int v) { return touches[v]; }))
                edges.push_back({f, obstacle_partner(k), -1});
    }
}

}  // namespace nbd
