#pragma once

#include <span>
#include <string>
#include <vector>

#include "sim/scene/scene.hpp"
#include "sim/world/world.hpp"

namespace nbd {

/// Names of a scene's bodies in messages, as "bodies[1] (cube)".
std::vector<std::string> body_labels(const SceneSpec& spec);

/// What may make the motion of a scene's bodies wrong, see body_hints(), with the scene's scales and
/// materials. One line for all bodies of which the same holds. And a line if spheres among the obstacles are
/// so small that they may pass between the vertices of a body, see vertex_gap(), at rest. bodies: one per
/// spec.bodies.
std::vector<std::string> scene_body_warnings(const SceneSpec& spec, std::span<const LoadedBody> bodies);

/// Lines about bodies whose walls face each other at rest across so little that contact of a body with itself
/// leaves them out, see SelfContactRest and rest_gaps(). world: of the scene, not moved yet.
std::vector<std::string> narrow_gap_warnings(const SceneSpec& spec, const World& world);

}  // namespace nbd
