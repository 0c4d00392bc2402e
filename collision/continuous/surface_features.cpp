#include "collision/continuous/surface_features.hpp"

#include <algorithm>
#include <stdexcept>

#include "collision/base/message.hpp"

namespace nbd {
namespace {

void list_edges(FacesRef F, SurfaceFeatures& features) {
    struct Side {
        int low, high, face, corner;
    };
    std::vector<Side> sides;
    sides.reserve(3 * F.rows());
    for (int f = 0; f < F.rows(); ++f)
        for (int k = 0; k < 3; ++k) {
            const int i = F(f, (k + 1) % 3), j = F(f, (k + 2) % 3);
            sides.push_back({std::min(i, j), std::max(i, j), f, k});
        }
    std::ranges::sort(sides, {}, [](const Side& s) { return std::array{s.low, s.high, s.face, s.corner}; });
    features.face_edges.resize(F.rows(), 3);
    features.edges.resize(sides.size(), 2);
    int edge = -1;
    for (std::size_t i = 0; i < sides.size(); ++i) {
        const Side& s = sides[i];
        if (i == 0 || sides[i - 1].low != s.low || sides[i - 1].high != s.high) {
            features.edges.row(++edge) << s.low, s.high;
            features.edge_owners.push_back(s.face);
        }
        features.face_edges(s.face, s.corner) = edge;
    }
    features.edges.conservativeResize(edge + 1, 2);
}

void list_vertex_faces(FacesRef F, int vertex_count, SurfaceFeatures& features) {
    std::vector<int>& begin = features.vertex_begin;
    begin.assign(static_cast<std::size_t>(vertex_count) + 1, 0);
    const auto corners = F.reshaped<Eigen::RowMajor>();
    for (const int v : corners) ++begin[static_cast<std::size_t>(v) + 1];
    for (std::size_t v = 1; v < begin.size(); ++v) begin[v] += begin[v - 1];
    features.vertex_faces.resize(F.size());
    std::vector<int> next(begin.begin(), begin.end() - 1);
    for (int f = 0; f < F.rows(); ++f)
        for (int k = 0; k < 3; ++k) {
            int& slot = next[F(f, k)];
            features.vertex_faces[slot++] = f;
        }
}

/// Calls visit(face) for the faces that have a vertex in common with `face`, itself included; some
/// repeatedly.
template <class Visit>
void for_each_neighbour(FacesRef F, const SurfaceFeatures& features, int face, const Visit& visit) {
    for (int k = 0; k < 3; ++k) {
        const std::size_t v = F(face, k);
        for (int i = features.vertex_begin[v]; i < features.vertex_begin[v + 1]; ++i)
            visit(features.vertex_faces[i]);
    }
}

bool are_apart(const SurfaceFeatures::Pairs& edges, int e, int f) {
    return edges(e, 0) != edges(f, 0) && edges(e, 0) != edges(f, 1) && edges(e, 1) != edges(f, 0) &&
           edges(e, 1) != edges(f, 1);
}

}  // namespace

SurfaceFeatures surface_features(FacesRef F, int vertex_count) {
    for (Eigen::Index f = 0; f < F.rows(); ++f)
        for (int k = 0; k < 3; ++k)
            if (F(f, k) < 0 || F(f, k) >= vertex_count)
                throw std::invalid_argument(message("surface: face ", f, " refers to vertex ", F(f, k),
                                                    ", but there are ", vertex_count));
    SurfaceFeatures features;
    list_edges(F, features);
    list_vertex_faces(F, vertex_count, features);
    return features;
}

std::vector<FeaturePair> neighbour_features(FacesRef F, const SurfaceFeatures& features, int surface) {
    std::vector<FeaturePair> pairs;
    for (int v = 0; v + 1 < std::ssize(features.vertex_begin); ++v) {
        const int owner = features.owner_of_vertex(v);
        if (owner < 0) continue;
        for_each_neighbour(F, features, owner, [&](int face) {
            if (!(F.row(face).array() == v).any())
                pairs.push_back({FeatureKind::vertex_face, surface, surface, v, face});
        });
    }
    for (int e = 0; e < features.edges.rows(); ++e)
        for_each_neighbour(F, features, features.owner_of_edge(e), [&](int face) {
            for (int k = 0; k < 3; ++k) {
                const int f = features.face_edges(face, k);
                if (e < f && features.owner_of_edge(f) == face && are_apart(features.edges, e, f))
                    pairs.push_back({FeatureKind::edge_edge, surface, surface, e, f});
            }
        });
    std::ranges::sort(pairs);
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
    return pairs;
}

std::array<int, 4> feature_vertices(const FeaturePair& pair, const NumberedSurface& a,
                                    const NumberedSurface& b) noexcept {
    if (pair.kind == FeatureKind::vertex_face)
        return {pair.a, b.F(pair.b, 0), b.F(pair.b, 1), b.F(pair.b, 2)};
    const auto &of_a = a.features.edges, &of_b = b.features.edges;
    return {of_a(pair.a, 0), of_a(pair.a, 1), of_b(pair.b, 0), of_b(pair.b, 1)};
}

}  // namespace nbd
