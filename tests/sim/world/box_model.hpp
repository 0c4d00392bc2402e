#pragma once

#include <memory>

#include "meshing/body/body.hpp"
#include "sim/world/world.hpp"

namespace nbd::test {

/// A box that several worlds and bodies can share.
struct Model {
    Body body;
    std::shared_ptr<const ElasticBody> elastic;
    std::shared_ptr<const CollisionTree> tree;

    Model(const Eigen::Vector3d& size, const Eigen::Vector3i& cells, const Material& material = {});
    /// hung: whether its tree has affine bounds.
    explicit Model(Body body, bool hung = false);

    WorldBody at(const Eigen::Vector3d& centre, const Eigen::Matrix3d& R = Eigen::Matrix3d::Identity(),
                 const Eigen::Vector3d& velocity = Eigen::Vector3d::Zero()) const;
};

/// A strip of one metre along x whose ends grips bring together in a quarter of a second, so that only
/// contact with itself can keep them apart.
WorldBody strip_whose_ends_meet(const Model& strip);

/// A rod along x, bent at its middle into a hairpin whose arms are `gap` apart. height: of the rod, metres.
Nodes hairpin(const Nodes& X, double height, double gap);

/// Two boxes without damping by mass that fly at each other.
void add_colliding_boxes(World& world);

Obstacle floor_at(double height, double friction = 0.5);

Eigen::Matrix3d turned(double angle);

/// Whether a step was solved as asked, in one part.
inline bool is_balanced(const WorldReport& report) {
    return report.failure.empty() && report.rejection.empty();
}

}  // namespace nbd::test
