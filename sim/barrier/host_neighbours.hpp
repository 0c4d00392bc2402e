#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "collision/wide_tree/wide_walk.hpp"
#include "sim/patches/contact_shape.hpp"

namespace nbd {

/// What is known at rest of the faces of a surface that hangs on the nodes of much larger tetrahedra, for
/// HostProof. The host of a vertex is the tetrahedron that carries it. The vertices of a host move by one
/// affine map, and the maps of hosts with common nodes agree on their hull: a point, line or plane. So the
/// gradients of the maps bound by how much the distances between faces shrink.
///
/// Let F be the gradient of one host, s its least stretch, and d the most by which the gradients of the hosts
/// around it differ from F. Points of two faces whose corners hang on these hosts, x at rest and y in a
/// pose, have |y1 - y2| >= s |x1 - x2| - d D. For the rest of the map beside F is constant on the host itself
/// and agrees where hosts touch, and so changes by no more than d along any way over them; D is the longest
/// of such ways between corners of the two faces.
class HostNeighbours {
 public:
    static constexpr int none = -1;
    static constexpr double unknown = std::numeric_limits<double>::infinity();

    struct Host {
        std::array<int, 4> nodes;       // ascending
        Eigen::Matrix3d inverse_edges;  // at rest, of the edges from the first node to the others
        Eigen::Vector3d centre;         // at rest
        std::vector<int> touching;      // other hosts with a common node, ascending
        std::vector<int> related;       // those of them in lists with this host, ascending
    };
    /// Two faces with a common vertex whose corners do not all have one host. ratio: D over their distance.
    struct NearFaces {
        FacePair faces;
        double ratio;
    };
    /// Two leaves of the tree that are near at rest, or a leaf and itself.
    struct NearLeaves {
        LeafPair leaves;
        double ratio;                    // the largest of their faces without a common vertex
        std::vector<int> others{};       // hosts of their vertices beside the one that D is measured with
        std::vector<NearFaces> faces{};  // of a ratio above common_ratio, by falling ratios
    };
    /// Of most faces; to know smaller ratios would prove hardly more.
    static constexpr double common_ratio = 1.5;

    /// tets: at rest. rest: positions of the vertices, [n, 3]. tree: over the
    /// shape's faces. near_leaves: pairs of its leaves that are near at rest.
    HostNeighbours(std::shared_ptr<const ContactShape> shape, const TetMesh& tets, Nodes rest,
                   const WideTree& tree, std::span<const LeafPair> near_leaves);

    const std::vector<Host>& hosts() const noexcept { return hosts_; }
    /// Number of a vertex' host, or `none` if it hangs on no tetrahedron.
    int host_of(int vertex) const noexcept { return host_of_[vertex]; }
    bool touch(int host_a, int host_b) const noexcept;
    using Face = std::array<int, 3>;
    Face face(int f) const { return {shape_->F(f, 0), shape_->F(f, 1), shape_->F(f, 2)}; }
    /// Those whose way is measured with the gradient of one host, by falling ratios.
    std::span<const NearFaces> near_faces(int host) const noexcept {
        const std::size_t h = host;
        return std::span(near_faces_).subspan(faces_begin_[h], faces_begin_[h + 1] - faces_begin_[h]);
    }
    /// Those that no host touches.
    std::span<const NearFaces> unknown_faces() const noexcept { return near_faces(hosts_.size()); }
    /// Those whose D is measured with the gradient of one host, by falling ratios.
    std::span<const NearLeaves> near_leaves(int host) const noexcept {
        const std::size_t h = host;
        return std::span(leaves_).subspan(leaves_begin_[h], leaves_begin_[h + 1] - leaves_begin_[h]);
    }
    /// Those that no host touches.
    std::span<const NearLeaves> unknown_leaves() const noexcept { return near_leaves(hosts_.size()); }
    /// The pairs of all near_leaves().
    const LeafPairSet& known_leaves() const noexcept { return known_leaves_; }

 private:
    /// The point, line or plane through the common nodes of two hosts.
    class Hull {
     public:
        Hull(const Host& a, const Host& b, const Nodes& X);
        double distance(const Eigen::Vector3d& x) const { return place(x).off; }
        Eigen::Vector3d nearest(const Eigen::Vector3d& x) const;
        /// Length of the shortest way from x to y by the hull.
        double way(const Eigen::Vector3d& x, const Eigen::Vector3d& y) const;

     private:
        struct Place {
            Eigen::Vector3d along;  // coordinates in the hull
            double off;             // distance from it
        };
        Place place(const Eigen::Vector3d& x) const;

        Eigen::Vector3d origin_;
        Eigen::Matrix3d axes_ = Eigen::Matrix3d::Zero();
        int dimension_ = 0;
    };

    void find_hosts(const TetMesh& tets);
    void find_touching(const Nodes& X);
    void find_faces();
    void find_related();
    struct Measured {
        int host = none;
        NearLeaves near;
    };
    Measured measured(const WideTree& tree, LeafPair pair) const;
    /// D of two faces with the gradient of a host that touches all hosts of their corners, metres.
    double way(const Face& a, const Face& b, int host) const;
    /// Distance at rest of their features without a common vertex, metres; and less than it, found fast.
    double distance(const Face& a, const Face& b) const;
    double least_distance(const Face& a, const Face& b) const;
    Eigen::Vector3d at(int vertex) const { return rest_.row(vertex); }
    const Hull& hull(int host_a, int host_b) const;
    int host_between(int a, int b) const;
    double way_to(int vertex, int host) const;
    double way(int v, int w, int host) const;

    std::shared_ptr<const ContactShape> shape_;
    Nodes rest_;
    std::vector<Host> hosts_;
    std::vector<int> host_of_;      // [n]
    std::vector<Hull> hulls_;       // of each host with those that touch it
    std::vector<int> hulls_begin_;  // [hosts]
    std::vector<NearFaces> near_faces_;
    std::vector<int> faces_begin_;  // [hosts + 2]
    std::vector<NearLeaves> leaves_;
    std::vector<int> leaves_begin_;  // [hosts + 2]
    LeafPairSet known_leaves_;
};

/// The hosts of the corners of two faces, without repeats: at most six. Holds `none` if a corner has none.
class HostsOfFaces {
 public:
    HostsOfFaces(const HostNeighbours& rest, const HostNeighbours::Face& a, const HostNeighbours::Face& b) {
        for (const HostNeighbours::Face* f : {&a, &b})
            for (const int v : *f) {
                const int host = rest.host_of(v);
                if (std::find(begin(), end(), host) == end()) hosts_[count_++] = host;
            }
    }
    const int* begin() const noexcept { return hosts_.data(); }
    const int* end() const noexcept { return hosts_.data() + count_; }
    int size() const noexcept { return count_; }
    bool all_touch(const HostNeighbours& rest, int host) const {
        return std::all_of(begin(), end(), [&](int other) { return rest.touch(host, other); });
    }

 private:
    std::array<int, 6> hosts_;
    int count_ = 0;
};

}  // namespace nbd
