#pragma once

#include <span>
#include <string>
#include <vector>

#include "sim/scene/scene.hpp"

namespace nbd {

/// Problems of a scene beyond its text: bodies that cannot be simulated, trees of other surfaces, regions
/// without nodes or with nodes held by another grip, unusable obstacles, bodies that overlap each other or an
/// obstacle at the start. One line each, JSON path first.
/// bodies: one per reading.spec.bodies; null entries are skipped. Obstacles with problems in their text are
/// skipped.
std::vector<std::string> scene_problems(const SceneReading& reading,
                                        std::span<const LoadedBody* const> bodies);

}  // namespace nbd
