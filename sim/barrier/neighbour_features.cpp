#include "sim/barrier/neighbour_features.hpp"

#include <algorithm>

namespace nbd {
namespace {

/// Calls visit(face) for the faces that have a vertex in common with `face`, itself included; some
/// repeatedly.
template <class Visit>
void for_each_neighbour(const Faces& F, const SurfaceTopology& topology, int face, const Visit& visit) {
    for (int k = 0; k < 3; ++k) {
        const auto v = static_cast<std::size_t>(F(face, k));
        for (int i = topology.vertex_begin[v]; i < topology.vertex_begin[v + 1]; ++i)
            visit(topology.vertex_faces[static_cast<std::size_t>(i)]);
    }
}

bool has_vertex(const Faces& F, int face, int vertex) { return (F.row(face).array() == vertex).any(); }

bool are_apart(const SurfaceTopology::Pairs& edges, int e, int f) {
    return edges(e, 0) != edges(f, 0) && edges(e, 0) != edges(f, 1) && edges(e, 1) != edges(f, 0) &&
           edges(e, 1) != edges(f, 1);
}

}  // namespace

std::vector<FeaturePair> neighbour_features(const Faces& F, const SurfaceTopology& topology, int surface) {
    std::vector<FeaturePair> pairs;
    for (int v = 0; v + 1 < static_cast<int>(topology.vertex_begin.size()); ++v) {
        const int owner = topology.owner_of_vertex(v);
        if (owner < 0) continue;
        for_each_neighbour(F, topology, owner, [&](int face) {
            if (!has_vertex(F, face, v))
                pairs.push_back({FeatureKind::vertex_face, surface, surface, v, face});
        });
    }
    for (int e = 0; e < static_cast<int>(topology.edges.rows()); ++e)
        for_each_neighbour(F, topology, topology.owner_of_edge(e), [&](int face) {
            for (int k = 0; k < 3; ++k) {
                const int f = topology.face_edges(face, k);
                if (e < f && topology.owner_of_edge(f) == face && are_apart(topology.edges, e, f))
                    pairs.push_back({FeatureKind::edge_edge, surface, surface, e, f});
            }
        });
    std::ranges::sort(pairs);
    const auto repeats = std::ranges::unique(pairs);
    pairs.erase(repeats.begin(), repeats.end());
    return pairs;
}

}  // namespace nbd
