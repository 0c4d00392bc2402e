#pragma once

#include <Eigen/Geometry>
#include <memory>

#include "sim/world/world.hpp"
#include "tests/sim/support/box_body.hpp"

namespace nbd::test {

/// A box that several worlds and bodies can share.
struct Model {
    Body body;
    std::shared_ptr<const ElasticBody> elastic;
    std::shared_ptr<const CollisionTree> tree;

    Model(const Eigen::Vector3d& size, const Eigen::Vector3i& cells, double young = 1e5)
        : body(box_body(size, cells, {.young = young})) {
        elastic = std::make_shared<const ElasticBody>(body.tets, body.material);
        CollisionTree exact;
        exact.vertex_count = static_cast<int>(body.surface.X.rows());
        exact.faces = body.surface.F;
        exact.spheres = build_sphere_tree(body.surface.X.cast<float>(), body.surface.F);
        tree = std::make_shared<const CollisionTree>(exact);
    }

    WorldBody at(const Eigen::Vector3d& centre, const Eigen::Matrix3d& R = Eigen::Matrix3d::Identity(),
                 const Eigen::Vector3d& velocity = Eigen::Vector3d::Zero()) const {
        WorldBody entry{.elastic = elastic, .W = body.W, .F = body.surface.F, .tree = tree};
        entry.state.x = (body.tets.X * R.transpose()).rowwise() + centre.transpose();
        entry.state.v = Nodes::Zero(body.tets.X.rows(), 3).rowwise() + velocity.transpose();
        return entry;
    }
};

inline Obstacle floor_at(double height, double friction = 0.5) {
    return {.shape = PlaneShape{.point = {0, 0, height}, .normal = Eigen::Vector3d::UnitZ()},
            .friction = friction};
}

inline Eigen::Matrix3d turned(double angle) {
    return Eigen::AngleAxisd(angle, Eigen::Vector3d(0.5, 0.3, 1).normalized()).toRotationMatrix();
}

}  // namespace nbd::test
