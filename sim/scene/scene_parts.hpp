#pragma once

#include <vector>

#include "sim/scene/scene.hpp"

// What build_world() and scene_problems() are made of.
namespace nbd {

/// Rows of x that lie in a region, ascending.
std::vector<int> nodes_in(const Region& region, NodesRef x);

/// A body as it enters a world: placed, moving, in its grips' hands. Throws std::invalid_argument on what
/// does not fit; a message about a grip starts with its JSON path.
WorldBody make_world_body(const SceneBody& spec, const LoadedBody& loaded);

/// Reads the mesh of an obstacle that is one. Throws std::invalid_argument or std::runtime_error where it
/// cannot be used.
Obstacle make_obstacle(const SceneObstacle& spec);

}  // namespace nbd
