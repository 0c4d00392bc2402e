#pragma once

#include <memory>
#include <string>
#include <vector>

#include "meshing/body/body.hpp"
#include "sim/world/world.hpp"

namespace nbd {

/// A scene to time the solvers on. Sound crosses the body in ten steps.
struct SimulateScene {
    std::string name;
    WorldBody body;
    std::vector<Obstacle> obstacles;
    Eigen::Vector3d gravity = Eigen::Vector3d::Zero();
    double dt = 0;  // seconds

    World world(const LinearSolveConfig& linear) const;
};

/// `fly`: a free body that spins and shears; `twist`: a body held at both ends of its longest axis, one of
/// which makes half a turn; `drop`: a body thrown onto a floor.
std::vector<SimulateScene> simulate_scenes(const Body& body,
                                           const std::shared_ptr<const ElasticBody>& elastic);

}  // namespace nbd
