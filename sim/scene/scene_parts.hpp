#pragma once

#include <vector>

#include "sim/scene/scene.hpp"

// Parts of build_world() and scene_problems().
namespace nbd {

/// Rows of x inside a region, ascending.
std::vector<int> nodes_in(const Region& region, NodesRef x);

/// Makes a body for a world: placed, with its velocities and grips. Throws std::invalid_argument for
/// inconsistent data; a message about a grip starts with its JSON path.
WorldBody make_world_body(const SceneBody& spec, const LoadedBody& loaded);

/// Makes an obstacle; reads its mesh if it has one. Throws std::invalid_argument or std::runtime_error if the
/// mesh cannot be used.
Obstacle make_obstacle(const SceneObstacle& spec);

}  // namespace nbd
