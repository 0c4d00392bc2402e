#pragma once

#include <span>
#include <string>
#include <vector>

#include "sim/scene/scene.hpp"

namespace nbd {

/// What is wrong with a scene whose text is right: bodies that cannot be simulated, trees of other surfaces,
/// regions without nodes or with nodes that another hand holds, obstacles that cannot be used, bodies that
/// overlap each other or an obstacle at the start. One line each, JSON path first.
/// bodies: one per reading.spec.bodies; null: not there, nothing is said of it. Obstacles whose text is wrong
/// are left out.
std::vector<std::string> scene_problems(const SceneReading& reading,
                                        std::span<const LoadedBody* const> bodies);

}  // namespace nbd
