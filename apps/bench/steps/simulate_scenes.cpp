#include "apps/bench/steps/simulate_scenes.hpp"

#include <cmath>
#include <numbers>

namespace nbd {
namespace {

/// Nodes within a `share` of the body's length from one of its ends along an axis.
std::vector<int> end_nodes(const Nodes& X, int axis, bool upper, double share) {
    const double low = X.col(axis).minCoeff(), high = X.col(axis).maxCoeff();
    std::vector<int> nodes;
    for (int i = 0; i < X.rows(); ++i) {
        const double along = (X(i, axis) - low) / (high - low);
        if (upper ? along > 1 - share : along < share) nodes.push_back(i);
    }
    return nodes;
}

}  // namespace

World SimulateScene::world(const LinearSolveConfig& linear) const {
    WorldConfig config;
    config.gravity = gravity;
    config.linear = linear;
    World result(config);
    result.add_body(body);
    for (const Obstacle& obstacle : obstacles) result.add_obstacle(obstacle);
    return result;
}

std::vector<SimulateScene> simulate_scenes(const Body& body,
                                           const std::shared_ptr<const ElasticBody>& elastic) {
    const Nodes X = body.tets.X.rowwise() - body.tets.X.colwise().mean();
    const Material material = mean_material(body);
    const double length = (X.colwise().maxCoeff() - X.colwise().minCoeff()).norm(),
                 speed = std::sqrt(material.young / material.density), time = length / speed;
    SimulateScene still{.name = {},
                        .body = {.elastic = elastic, .W = body.W, .F = body.surface.F},
                        .obstacles = {},
                        .dt = 0.1 * time};
    still.body.state = {X, Nodes::Zero(X.rows(), 3)};
    std::vector<SimulateScene> scenes(3, still);

    SimulateScene& fly = scenes[0];
    fly.name = "fly";
    const double rate = 0.5 / time;
    Eigen::Matrix3d gradient;
    gradient << 0.4, -1, 0.8, 1, -0.4, 0, 0.2, 0, 0;
    fly.body.state.v = X * (rate * gradient).transpose();

    SimulateScene& twist = scenes[1];
    twist.name = "twist";
    Eigen::Index axis = 0;
    (X.colwise().maxCoeff() - X.colwise().minCoeff()).maxCoeff(&axis);
    const int along = axis;
    twist.body.grips = {{.nodes = end_nodes(X, along, false, 0.1)},
                        {.nodes = end_nodes(X, along, true, 0.1),
                         .rotation = std::numbers::pi * Eigen::Vector3d::Unit(along),
                         .duration = 60 * twist.dt}};

    SimulateScene& drop = scenes[2];
    drop.name = "drop";
    drop.gravity = {0, 0, -9.81};
    drop.body.state.v.col(2).setConstant(-0.3 * speed);
    drop.obstacles = {{.shape = PlaneShape{.point = {0, 0, X.col(2).minCoeff() - 0.02 * length},
                                           .normal = Eigen::Vector3d::UnitZ()}}};
    return scenes;
}

}  // namespace nbd
