#include "tests/sim/world/box_model.hpp"

#include <Eigen/Geometry>

#include "tests/support/box_body.hpp"

namespace nbd::test {

Model::Model(const Eigen::Vector3d& size, const Eigen::Vector3i& cells, double young)
    : body(box_body(size, cells, {.young = young})) {
    elastic = std::make_shared<const ElasticBody>(body.tets, body.material);
    CollisionTree exact;
    exact.vertex_count = static_cast<int>(body.surface.X.rows());
    exact.faces = body.surface.F;
    exact.spheres = build_sphere_tree(body.surface.X.cast<float>(), body.surface.F);
    tree = std::make_shared<const CollisionTree>(exact);
}

WorldBody Model::at(const Eigen::Vector3d& centre, const Eigen::Matrix3d& R,
                    const Eigen::Vector3d& velocity) const {
    WorldBody entry{.elastic = elastic, .W = body.W, .F = body.surface.F, .tree = tree};
    entry.state.x = (body.tets.X * R.transpose()).rowwise() + centre.transpose();
    entry.state.v = Nodes::Zero(body.tets.X.rows(), 3).rowwise() + velocity.transpose();
    return entry;
}

Obstacle floor_at(double height, double friction) {
    return {.shape = PlaneShape{.point = {0, 0, height}, .normal = Eigen::Vector3d::UnitZ()},
            .friction = friction};
}

Eigen::Matrix3d turned(double angle) {
    return Eigen::AngleAxisd(angle, Eigen::Vector3d(0.5, 0.3, 1).normalized()).toRotationMatrix();
}

}  // namespace nbd::test
