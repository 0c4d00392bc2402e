#pragma once

#include <span>
#include <vector>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Edges of a surface with their faces. Half-edge 3 f + k runs from corner k of face f to the next corner.
struct EdgeTable {
    struct Edge {
        int a = 0, b = 0;        // vertices, a < b
        int begin = 0, end = 0;  // range in `halfedges`
    };
    std::vector<Edge> edges;     // sorted by (a, b)
    std::vector<int> halfedges;  // half-edges of edge 0, ascending, then of edge 1, ...
    std::vector<int> edge_of;    // [3 faces] edge of each half-edge

    std::span<const int> at(const Edge& edge) const noexcept {
        return std::span(halfedges).subspan(edge.begin, edge.end - edge.begin);
    }

    /// The other half-edge of the same edge. The surface must be closed and edge-manifold.
    int twin(int halfedge) const noexcept {
        const Edge& edge = edges[edge_of[halfedge]];
        const int first = halfedges[edge.begin];
        return first == halfedge ? halfedges[edge.begin + 1] : first;
    }
};

/// F: non-negative indices, three different ones per face.
EdgeTable edge_table(FacesRef F);

/// Numbers 0 to count - 1 in disjoint sets. The least number stands for its set.
class DisjointSets {
 public:
    explicit DisjointSets(int count);
    void join(int a, int b);
    int root(int number);
    int count() const noexcept { return count_; }  // of sets

 private:
    std::vector<int> parent_;
    int count_;
};

/// Connected components of a surface.
struct Components {
    int count = 0;
    std::vector<int> of_face;  // [faces] component of each face; components are numbered by their first face
};

/// Flips faces (swaps their last two corners) until neighbours agree. The first face of each component keeps
/// its orientation. `table` belongs to F; afterwards its edges stay valid, its half-edge numbers do not.
/// Throws std::invalid_argument naming two faces if the surface is one-sided.
Components make_orientations_agree(Faces& F, const EdgeTable& table);

}  // namespace nbd
