#pragma once

#include <array>
#include <vector>

#include "collision/continuous/feature_pair.hpp"
#include "collision/geometry/geometry.hpp"

namespace nbd {

/// Edges of a surface, each once, and the faces at its vertices. Does not change while the surface moves.
struct SurfaceFeatures {
    using Pairs = Eigen::Matrix<int, Eigen::Dynamic, 2, Eigen::RowMajor>;
    Faces face_edges;               // [m, 3] edges opposite corners 0, 1, 2
    Pairs edges;                    // [e, 2] vertices, smaller first; rows in lexicographic order
    std::vector<int> edge_owners;   // [e] the first face of each edge
    std::vector<int> vertex_begin;  // [n + 1] range of vertex_faces
    std::vector<int> vertex_faces;  // faces at each vertex, ascending

    /// The face that owns a vertex or an edge, the first of its faces, so that a loop over faces can visit it
    /// once; -1 for a vertex without faces.
    int owner_of_vertex(int vertex) const noexcept {
        const std::size_t v = vertex;
        return vertex_begin[v] < vertex_begin[v + 1] ? vertex_faces[vertex_begin[v]] : -1;
    }
    int owner_of_edge(int edge) const noexcept { return edge_owners[edge]; }
};

/// Any number of faces may share an edge. Throws std::invalid_argument for an index outside
/// 0 .. vertex_count - 1.
SurfaceFeatures surface_features(FacesRef F, int vertex_count);

/// The pairs of features of one surface whose owners have a vertex in common but which have none themselves.
/// Queries of a surface with itself leave out such owners. surface: its number, for the pairs. Sorted,
/// without repeats; of two edges, the smaller first.
std::vector<FeaturePair> neighbour_features(FacesRef F, const SurfaceFeatures& features, int surface);

/// A surface of several: its number, faces and features.
struct NumberedSurface {
    int number;
    const Faces& F;
    const SurfaceFeatures& features;
};

/// The corners of a pair in the order of closest_points(). a, b: the surfaces of the pair.
std::array<int, 4> feature_vertices(const FeaturePair& pair, const NumberedSurface& a,
                                    const NumberedSurface& b) noexcept;

/// Where the corners of a pair stand among those of two faces: 0 to 2 in the first, 3 to 5 in the second. In
/// the order of closest_points(), but for which end of an edge and which of two edges comes first.
using PlacesInFaces = std::array<std::int8_t, 4>;

/// Calls visit(pair, places) for the features that the two faces own, each with those of the other. Over all
/// pairs of faces, every pair of features comes once, unless a face names a vertex twice. Features of faces
/// with common vertices may have some, too.
template <class Visit>
void for_each_owned_pair(const NumberedSurface& s, const NumberedSurface& t, FacePair faces,
                         const Visit& visit) {
    const auto place = [](int corner) { return static_cast<std::int8_t>(corner); };
    for (int k = 0; k < 3; ++k) {
        if (const int v = s.F(faces.a, k); s.features.owner_of_vertex(v) == faces.a)
            visit(FeaturePair{FeatureKind::vertex_face, s.number, t.number, v, faces.b},
                  PlacesInFaces{place(k), 3, 4, 5});
        if (const int v = t.F(faces.b, k); t.features.owner_of_vertex(v) == faces.b)
            visit(FeaturePair{FeatureKind::vertex_face, t.number, s.number, v, faces.a},
                  PlacesInFaces{place(3 + k), 0, 1, 2});
        const int e = s.features.face_edges(faces.a, k);
        if (s.features.owner_of_edge(e) != faces.a) continue;
        for (int l = 0; l < 3; ++l) {
            const int f = t.features.face_edges(faces.b, l);
            if (t.features.owner_of_edge(f) != faces.b) continue;
            const bool swapped = s.number == t.number && f < e;
            visit(FeaturePair{FeatureKind::edge_edge, s.number, t.number, swapped ? f : e, swapped ? e : f},
                  PlacesInFaces{place((k + 1) % 3), place((k + 2) % 3), place(3 + (l + 1) % 3),
                                place(3 + (l + 2) % 3)});
        }
    }
}

}  // namespace nbd
