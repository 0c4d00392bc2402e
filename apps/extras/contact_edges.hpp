#pragma once

#include <memory>
#include <span>
#include <vector>

#include "collision/geometry/embedding.hpp"
#include "collision/query/pair_query.hpp"
#include "collision/query/self_query.hpp"
#include "sim/obstacles/obstacle.hpp"
#include "training/files/recording.hpp"

namespace nbd {

/// A surface whose contact is sought; copies of a body share it.
struct ContactEdgeSurface {
    std::shared_ptr<const CollisionTree> tree;        // of the surface
    SurfaceEmbedding W;                               // [n, N]
    ContactDistances distances{};                     // each a number in single precision
    std::shared_ptr<const FacePairSet> near_at_rest;  // within twice distances.self

    /// rest: of the surface, [n, 3], metres. Throws as near_at_rest().
    ContactEdgeSurface(std::shared_ptr<const CollisionTree> tree, SurfaceEmbedding W, VerticesRef rest,
                       const ContactDistances& distances);
};

/// Finds which faces touch in the frames of a recording. Faces of two bodies touch that are at most
/// `distances.bodies` apart, those of one body that are at most `distances.self` apart, have no common vertex
/// and are more than twice as far apart at rest. A face touches an obstacle if one of its vertices is at most
/// `distances.bodies` in front of it, or behind its surface. Exact, for positions in single precision,
/// x = W nodes.
class ContactEdgeFinder {
 public:
    /// surfaces: [bodies]. ids: their trajectories; unrecorded_partner for a body without one.
    ContactEdgeFinder(std::vector<std::shared_ptr<const ContactEdgeSurface>> surfaces, std::vector<int> ids,
                      std::vector<Obstacle> obstacles);

    const ContactDistances& distances(std::size_t body) const { return surfaces_.at(body)->distances; }

    /// Edges of all bodies, sorted; empty for those without a trajectory. nodes: [bodies] as recorded, [N,
    /// 3]. time: seconds.
    std::vector<std::vector<ContactEdge>> find(std::span<const Vertices> nodes, double time);

 private:
    void meet_obstacles(std::size_t body, double time, std::vector<ContactEdge>& edges) const;

    std::vector<std::shared_ptr<const ContactEdgeSurface>> surfaces_;
    std::vector<int> ids_;
    std::vector<Obstacle> obstacles_;
    std::vector<Vertices> x_;
    std::vector<PosedTree> posed_;
    std::vector<SelfQuery> self_;
    PairQuery query_;
};

}  // namespace nbd
