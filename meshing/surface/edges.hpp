#pragma once

#include <span>
#include <vector>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// The edges of a surface and the faces at them. Half-edge 3 f + k runs from corner k of face f to the next.
struct EdgeTable {
    struct Edge {
        int a = 0, b = 0;        // its vertices, a < b
        int begin = 0, end = 0;  // range of `halfedges`
    };
    std::vector<Edge> edges;     // sorted by (a, b)
    std::vector<int> halfedges;  // those of edge 0, ascending, then those of edge 1, ...
    std::vector<int> edge_of;    // [3 faces] the edge of each half-edge

    std::span<const int> at(const Edge& edge) const noexcept {
        return std::span(halfedges).subspan(static_cast<std::size_t>(edge.begin),
                                            static_cast<std::size_t>(edge.end - edge.begin));
    }

    /// The other half-edge of a closed, edge-manifold surface's edge.
    int twin(int halfedge) const noexcept {
        const Edge& edge = edges[static_cast<std::size_t>(edge_of[static_cast<std::size_t>(halfedge)])];
        const int first = halfedges[static_cast<std::size_t>(edge.begin)];
        return first == halfedge ? halfedges[static_cast<std::size_t>(edge.begin) + 1] : first;
    }
};

/// F: indices not negative; a face has three different ones.
EdgeTable edge_table(FacesRef F);

}  // namespace nbd
