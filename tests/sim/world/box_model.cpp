#include "tests/sim/world/box_model.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "tests/support/box_body.hpp"
#include "tests/support/box_mesh.hpp"

namespace nbd::test {

Model::Model(const Eigen::Vector3d& size, const Eigen::Vector3i& cells, const Material& material)
    : Model(box_body(size, cells, material)) {}

Model::Model(Body given, bool hung) : body(std::move(given)) {
    elastic = std::make_shared<const ElasticBody>(body.tets, body.material);
    CollisionTree exact = make_exact_tree(body.surface.X.cast<float>(), body.surface.F);
    if (hung) hang_on_nodes(exact, body.W.cast<float>(), body.tets.X.cast<float>());
    tree = std::make_shared<const CollisionTree>(std::move(exact));
}

WorldBody Model::at(const Eigen::Vector3d& centre, const Eigen::Matrix3d& R,
                    const Eigen::Vector3d& velocity) const {
    WorldBody entry{.elastic = elastic, .W = body.W, .F = body.surface.F, .tree = tree};
    entry.state.x = (body.tets.X * R.transpose()).rowwise() + centre.transpose();
    entry.state.v = Nodes::Zero(body.tets.X.rows(), 3).rowwise() + velocity.transpose();
    return entry;
}

Nodes hairpin(const Nodes& X, double height, double gap) {
    const double radius = (height + gap) / 2, half = std::numbers::pi / 2 * radius;
    Nodes x = X;
    for (Eigen::Index i = 0; i < X.rows(); ++i) {
        const double s = X(i, 0), side = s < 0 ? -1 : 1;
        const double angle = side * std::min(std::abs(s), half) / radius,
                     along = std::max(std::abs(s) - half, 0.0);
        const double out = radius - X(i, 2);  // from the middle of the bend
        x(i, 0) = out * std::cos(angle) - along;
        x(i, 2) = out * std::sin(angle);
    }
    return x;
}

WorldBody strip_whose_ends_meet(const Model& strip) {
    WorldBody body = strip.at({0, 0, 0});
    for (const double side : {-1.0, 1.0}) {
        Grip grip{.nodes = nodes_where(body.state.x,
                                       [&](const Eigen::Vector3d& x) { return side * x.x() > 0.46; })};
        grip.motion =
            eased({.centre = {0.06 * side, 0, 0}, .rotation = {0, -1.65 * side, 0}, .duration = 0.25});
        body.grips.push_back(grip);
    }
    return body;
}

void add_colliding_boxes(World& world) {
    const Model box({0.6, 0.4, 0.3}, {3, 2, 2}, {.young = 1e5, .rayleigh_mass = 0});
    world.add_body(box.at({0, 0, 0}, turned(0.2), {1.2, 0.1, 0}));
    world.add_body(box.at({0.75, 0.1, 0.05}, turned(-0.5), {-0.8, 0, 0.1}));
}

Obstacle floor_at(double height, double friction) {
    return {.shape = PlaneShape{.point = {0, 0, height}, .normal = Eigen::Vector3d::UnitZ()},
            .friction = friction};
}

Eigen::Matrix3d turned(double angle) {
    return Eigen::AngleAxisd(angle, Eigen::Vector3d(0.5, 0.3, 1).normalized()).toRotationMatrix();
}

}  // namespace nbd::test
