#pragma once

#include <Eigen/SparseCore>
#include <span>
#include <vector>

#include "collision/geometry/geometry.hpp"
#include "collision/geometry/tet_mesh.hpp"

namespace nbd {

class PathForest;

/// Weights that map tet nodes to surface vertices, [n, N], in the form that training stores.
using SurfaceWeights = Eigen::SparseMatrix<float, Eigen::RowMajor>;

/// Short straight links inside the tetrahedra, between tet nodes and the surface vertices that depend on
/// them. Every chain of links is a path inside the solid, whose deformation can be bounded.
class SolidGraph {
 public:
    struct Link {
        int to = 0;
        int region = 0;     // region of a tetrahedron that contains the link
        double length = 0;  // rest length, metres
    };

    /// solid: valid by check_solid(); W: [n, N]; F: faces over the n vertices; of_tet: region of each
    /// tetrahedron. Throws std::invalid_argument on an empty row of W, or on a row with nodes that no
    /// tetrahedra connect.
    SolidGraph(const TetMesh& solid, const SurfaceWeights& W, FacesRef F, std::span<const int> of_tet);

    int point_count() const noexcept { return static_cast<int>(begin_.size()) - 1; }
    std::span<const Link> links(int point) const noexcept {
        const int first = begin_[static_cast<std::size_t>(point)];
        return std::span(links_).subspan(
            static_cast<std::size_t>(first),
            static_cast<std::size_t>(begin_[static_cast<std::size_t>(point) + 1] - first));
    }

    /// The place of a surface vertex: a tet node, a point of its own or, if it depends on nodes of several
    /// tetrahedra, the node with most weight. In the last case it is `tail` metres away from that node,
    /// through `regions`.
    struct Place {
        int point = 0;
        std::vector<int> homes{};    // tetrahedra that move it and whose closure contains it
        double tail = 0;             // sum of |weight| times path length over its nodes, metres
        std::vector<int> regions{};  // regions of these paths; empty without a tail
    };
    const Place& place(int vertex) const noexcept { return places_[static_cast<std::size_t>(vertex)]; }
    const Nodes& X() const noexcept { return X_; }  // [n, 3] rest positions of surface vertices: W X

    /// The longest rest path from a vertex to a node that it depends on, metres.
    double reach() const noexcept { return reach_; }

 private:
    void join(int a, int b, double length, int region);
    void link_nodes(const TetMesh& solid, std::span<const int> of_tet);
    void place_vertex(int v, const TetMesh& solid, const SurfaceWeights& W, std::span<const int> of_tet,
                      PathForest& forest, std::vector<char>& wanted);
    void hang(Place& place, std::span<const int> nodes, std::span<const double> weights, PathForest& forest,
              std::vector<char>& wanted);
    void pack(int points);

    struct Pair {
        int a = 0, b = 0;
        Link link{};
    };
    std::vector<std::vector<int>> tets_of_;  // [N] tetrahedra of each node
    std::vector<Pair> pairs_;                // links in the order of their creation
    std::vector<int> begin_;
    std::vector<Link> links_;
    std::vector<Place> places_;
    Nodes X_;
    double reach_ = 0;
};

}  // namespace nbd
