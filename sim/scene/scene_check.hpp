#pragma once

#include <span>
#include <string>
#include <vector>

#include "sim/scene/scene.hpp"

namespace nbd {

/// What is wrong with a scene, and what may make its motion wrong. One line each, JSON path first.
struct SceneFindings {
    std::vector<std::string> problems, warnings;
};

/// Checks a scene beyond its text. Problems: bodies that cannot be simulated, trees of other surfaces,
/// regions without nodes or with nodes held by another grip, unusable obstacles, bodies that overlap each
/// other or an obstacle at the start. Warnings: bodies that touch something then, and those of
/// scene_body_warnings(). bodies: one per reading.spec.bodies. Obstacles with problems in their text are
/// skipped.
SceneFindings check_scene(const SceneReading& reading, std::span<const LoadedBody> bodies);

}  // namespace nbd
