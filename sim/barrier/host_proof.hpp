#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

#include "sim/barrier/host_neighbours.hpp"

namespace nbd {

/// Proves of faces of one body that they keep at least a tenth of the distance that they have at rest all
/// along a motion, by the gradients of their hosts and how the nodes about these differ: see HostNeighbours.
/// A motion is straight for every vertex. Faces whose corners all have one host keep apart in any pose that
/// does not make it flat.
class HostProof {
 public:
    /// Of its distance at rest: a pair that keeps more does not press.
    static constexpr double least_share = 0.1;

    explicit HostProof(std::shared_ptr<const HostNeighbours> rest);

    /// begin, end: positions of the nodes, [N, 3]. Numbers that are not finite prove nothing.
    void prove(const Nodes& begin, const Nodes& end);

    /// Whether all corners of two faces have one host.
    bool hang_on_one_host(FacePair faces) const noexcept { return rest_->hang_on_one_host(faces); }

    /// The pairs of known leaves of whose faces little is proved, see SelfQuery::boxes_within().
    std::span<const LeafPair> open_leaves() const noexcept { return open_leaves_; }
    const LeafPairSet& known_leaves() const noexcept { return rest_->known_leaves(); }
    /// The other faces of known leaves, and faces with a common vertex, that may not keep their distance.
    std::span<const FacePair> open_faces() const noexcept { return open_faces_; }

 private:
    void measure(int host, const Nodes& begin, const Nodes& end);
    void add_open(const HostNeighbours::Group& group, double stretch, double difference);

    std::shared_ptr<const HostNeighbours> rest_;
    // At any time of the motion: the least stretch, the residuals of a host's others over their distances,
    // and the largest of these.
    std::vector<double> stretches_, differences_;  // [hosts]
    std::vector<std::vector<double>> residuals_;   // [hosts][others]
    std::vector<LeafPair> open_leaves_;
    std::vector<FacePair> open_faces_;
};

}  // namespace nbd
