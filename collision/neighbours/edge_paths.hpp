#pragma once

#include <compare>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "collision/geometry/geometry.hpp"
#include "collision/geometry/tet_mesh.hpp"

namespace nbd {

/// The edges of a surface as a graph: which vertices each vertex is joined to, and its faces.
class EdgeGraph {
 public:
    /// F: faces over `vertex_count` vertices.
    EdgeGraph(FacesRef F, int vertex_count);

    /// Ascending, without repeats.
    std::span<const int> neighbours(int vertex) const noexcept { return vertices_.of(vertex); }
    std::span<const int> faces(int vertex) const noexcept { return faces_.of(vertex); }

 private:
    struct Lists {
        /// ends: pairs of a vertex and an item of its list.
        Lists(std::vector<std::pair<int, int>> ends, int vertex_count);
        std::span<const int> of(int vertex) const noexcept {
            const std::size_t v = vertex;
            return std::span(items).subspan(begin[v], begin[v + 1] - begin[v]);
        }
        std::vector<int> begin, items;
    };
    Lists vertices_, faces_;
};

/// Finds what is near along the edges of a surface, by their shortest paths [Dijkstra59]. Owns its scratch
/// memory; one object per thread.
class EdgePaths {
 public:
    /// graph, X: must outlive this object. X: positions [n, 3], metres.
    EdgePaths(const EdgeGraph& graph, const Nodes& X);

    /// Appends to `vertices`, which must hold no repeats, those that are at most `radius` metres away from
    /// them along edges, nearer ones first, up to `most` vertices in all.
    void grow(std::vector<int>& vertices, double radius, std::size_t most);

 private:
    struct Reached {
        double length;
        int vertex;
        auto operator<=>(const Reached&) const = default;
    };
    void push(double length, int vertex);
    Reached pop();

    const EdgeGraph& graph_;
    const Nodes& X_;
    std::vector<double> lengths_;  // [n] infinite between calls
    std::vector<char> is_taken_;   // [n] 0 between calls
    std::vector<int> touched_;
    std::vector<Reached> heap_;
};

}  // namespace nbd
