#pragma once

#include <Eigen/SparseCore>
#include <span>
#include <vector>

#include "collision/geometry/geometry.hpp"
#include "collision/geometry/tet_mesh.hpp"

namespace nbd {

class PathForest;

/// Weights that carry tet nodes to surface vertices, [n, N], as training keeps them.
using SurfaceWeights = Eigen::SparseMatrix<float, Eigen::RowMajor>;

/// Short straight ways inside the tetrahedra, between tet nodes and the surface vertices that they carry:
/// every chain of links is a path inside the solid, for bounds on what a deformation does to it.
class SolidGraph {
 public:
    struct Link {
        int to = 0;
        int region = 0;     // of a tetrahedron that holds the link
        double length = 0;  // at rest, metres
    };

    /// solid: checked; W: [n, N]; F: faces over the n vertices; of_tet: region of each tetrahedron.
    /// Throws std::invalid_argument on an empty row of W.
    SolidGraph(const TetMesh& solid, const SurfaceWeights& W, FacesRef F, std::span<const int> of_tet);

    int point_count() const noexcept { return static_cast<int>(begin_.size()) - 1; }
    std::span<const Link> links(int point) const noexcept {
        const int first = begin_[static_cast<std::size_t>(point)];
        return std::span(links_).subspan(
            static_cast<std::size_t>(first),
            static_cast<std::size_t>(begin_[static_cast<std::size_t>(point) + 1] - first));
    }

    /// Where a surface vertex is: a tet node, a point of its own, or, where it hangs on nodes of several
    /// tetrahedra, the node with most weight; it is then `tail` metres away from that, through `regions`.
    struct Place {
        int point = 0;
        std::vector<int> homes{};    // tetrahedra that it moves with, in whose closure it lies
        double tail = 0;             // sum of |weight| times the path to the node, metres
        std::vector<int> regions{};  // of these paths; empty without a tail
    };
    const Place& place(int vertex) const noexcept { return places_[static_cast<std::size_t>(vertex)]; }
    const Nodes& X() const noexcept { return X_; }  // [n, 3] surface vertices at rest: W times the nodes

    /// The longest rest path from a vertex to a node that it hangs on, metres.
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
    std::vector<std::vector<int>> tets_of_;  // [N]
    std::vector<Pair> pairs_;                // until they are packed
    std::vector<int> begin_;
    std::vector<Link> links_;
    std::vector<Place> places_;
    Nodes X_;
    double reach_ = 0;
};

}  // namespace nbd
