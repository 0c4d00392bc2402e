#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "collision/wide_tree/wide_walk.hpp"
#include "sim/barrier/contained_pairs.hpp"
#include "sim/patches/contact_shape.hpp"

namespace nbd {

/// What is known at rest of the faces of a surface that tetrahedra carry, for HostProof. The host of some
/// vertices is one of these, or of the corner_tets() of quadratic ones, in their middle. Its affine map, with
/// gradient F, takes each node to where it stands but for a residual r, which is zero for its own nodes. A
/// vertex is a sum of nodes with weights w that add to one. So two vertices, x at rest and y in a pose, have
/// y1 - y2 = F (x1 - x2) + sum of (w1 - w2) r, and points of two faces differ by no more from F (x1 - x2)
/// than some corners of theirs do.
///
/// Let s be the least stretch of F, and d the largest of |r| over the distance of its node from the host at
/// rest. Then points of the faces have |y1 - y2| >= s |x1 - x2| - d D. D is the largest sum of |w1 - w2|
/// times these distances, of corners of the two faces.
class HostNeighbours {
 public:
    static constexpr int none = -1;
    static constexpr double unknown = std::numeric_limits<double>::infinity();

    struct Host {
        std::array<int, 4> nodes;         // ascending
        Eigen::Matrix3d inverse_edges;    // at rest, of the edges from the first node to the others
        Eigen::Vector3d centre;           // at rest
        std::vector<int> others{};        // nodes beside its own that carry faces in its groups, ascending
        std::vector<double> distances{};  // of these from the centre at rest, metres
    };
    /// ratio: D over the distance of the faces at rest.
    struct NearFaces {
        FacePair faces;
        double ratio;
    };
    /// Faces that are near at rest and measured with one host: those of two leaves of the tree (or of a leaf
    /// and itself) without a common vertex, or those that have a common vertex with one face.
    struct Group {
        std::optional<LeafPair> leaves{};
        double ratio = unknown;          // the largest of its faces
        std::vector<int> others{};       // places among the host's others of those that carry its faces
        std::vector<NearFaces> faces{};  // by falling ratios; of leaves those above common_ratio
    };
    /// Of most faces; to know smaller ratios would prove hardly more.
    static constexpr double common_ratio = 1.5;

    /// tets: at rest. rest: positions of the vertices, [n, 3]. tree: over the
    /// shape's faces. near_leaves: pairs of its leaves that are near at rest.
    HostNeighbours(std::shared_ptr<const ContactShape> shape, const TetMesh& tets, Nodes rest,
                   const WideTree& tree, std::span<const LeafPair> near_leaves);

    const std::vector<Host>& hosts() const noexcept { return hosts_; }
    /// Those measured with one host, by falling ratios.
    std::span<const Group> groups(int host) const noexcept {
        const std::size_t h = host;
        return std::span(groups_).subspan(begin_[h], begin_[h + 1] - begin_[h]);
    }
    /// Those of which nothing is known.
    std::span<const Group> unknown_groups() const noexcept { return groups(hosts_.size()); }
    /// The pairs of leaves of all groups.
    const LeafPairSet& known_leaves() const noexcept { return known_leaves_; }
    /// Pairs of leaves that are in no group, with the faces in them that have a common vertex.
    const ContainedPairs& contained() const noexcept { return contained_; }
    /// Appends the pairs of faces of two leaves that have a common vertex.
    void add_neighbours(LeafPair leaves, std::vector<FacePair>& pairs) const;
    /// Whether one tetrahedron carries all corners of two faces.
    bool hang_on_one_host(FacePair faces) const noexcept;
    const Nodes& nodes() const noexcept { return nodes_; }  // at rest

 private:
    using Face = std::array<int, 3>;
    struct Measured {
        int host = none;
        Group group;
    };
    /// Some vertices measured with one host.
    class Spread {
     public:
        Spread(const HostNeighbours& rest, std::vector<int> vertices);
        int host() const noexcept { return host_; }
        const std::vector<int>& others() const noexcept { return others_; }  // nodes
        /// D of two vertices by their places, metres.
        double between(std::size_t i, std::size_t j) const { return (of(i) - of(j)).lpNorm<1>(); }
        /// Of two vertices, the sum of these is at least between(i, j).
        double from_middle(std::size_t i) const { return (of(i) - middle_).lpNorm<1>(); }

     private:
        Eigen::MatrixXd::ConstColXpr of(std::size_t i) const { return weights_.col(i); }

        int host_ = none;
        std::vector<int> others_;
        Eigen::MatrixXd weights_;  // [others, vertices], times distances from the host
        Eigen::VectorXd middle_;
    };

    void find_hosts(const TetMesh& tets);
    Measured measured(const WideTree& tree, LeafPair pair) const;
    Measured measured(int face, const std::vector<LeafPair>& contained) const;
    void add(std::vector<Measured> all);
    Face face(int f) const { return {shape_->F(f, 0), shape_->F(f, 1), shape_->F(f, 2)}; }
    /// Distance at rest of their features without a common vertex, metres.
    double distance(const Face& a, const Face& b) const;
    double gap_between_middles(const Face& a, const Face& b) const;
    Eigen::Vector3d at(int vertex) const { return rest_.row(vertex); }

    std::shared_ptr<const ContactShape> shape_;
    Nodes nodes_, rest_;
    std::vector<int> leaf_of_;  // [faces]
    IndexLists faces_of_leaf_;
    ContainedPairs contained_;
    std::vector<Host> hosts_;
    std::vector<int> host_of_;      // [n] the host that carries most of a vertex; none: no node carries it
    std::vector<char> is_carried_;  // [n] whether that host carries all of it
    std::vector<Group> groups_;
    std::vector<int> begin_;  // [hosts + 2]
    LeafPairSet known_leaves_;
};

}  // namespace nbd
