#pragma once

#include <Eigen/Core>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "sim/barrier/host_neighbours.hpp"

namespace nbd {

/// Proves of faces of one body that they keep at least half of the distance that they have at rest all along
/// a motion, by the gradients of their hosts: see HostNeighbours. A motion is straight for every vertex.
/// Faces whose corners all have one host keep apart in any pose that does not make it flat.
class HostProof {
 public:
    /// Of its distance at rest: a pair that keeps more does not press.
    static constexpr double least_share = 0.5;

    explicit HostProof(std::shared_ptr<const HostNeighbours> rest);

    /// begin, end: positions of the nodes, [N, 3]. Numbers that are not finite prove nothing.
    void prove(const Nodes& begin, const Nodes& end);

    /// Whether all corners of two faces have one host.
    bool hang_on_one_host(FacePair faces) const;

    /// The pairs of known leaves of whose faces little is proved, see SelfQuery::boxes_within().
    std::span<const LeafPair> open_leaves() const noexcept { return open_leaves_; }
    const LeafPairSet& known_leaves() const noexcept { return rest_->known_leaves(); }
    /// The other faces of known leaves, and faces with a common vertex, that may not keep their distance.
    std::span<const FacePair> open_faces() const noexcept { return open_faces_; }

 private:
    void add_open(int host, double most, std::span<const HostNeighbours::NearFaces> near);
    double difference(int host, int other) const noexcept;
    template <class Hosts>
    double most_difference(int host, const Hosts& others) const noexcept;
    /// Whether faces with this ratio, in which each of the other hosts differs by no more, keep apart.
    static bool keeps_apart(double stretch, double difference, double ratio) noexcept {
        return stretch - difference * ratio >= least_share;
    }

    std::shared_ptr<const HostNeighbours> rest_;
    std::vector<Eigen::Matrix3d> at_begin_, at_end_;  // [hosts] gradients
    std::vector<double> stretches_, differences_;     // [hosts] at any time of the motion: the least,
                                                      // and the most from related hosts
    std::vector<LeafPair> open_leaves_;
    std::vector<FacePair> open_faces_;
};

}  // namespace nbd
