#pragma once

#include <span>
#include <string>
#include <vector>

#include "sim/scene/scene.hpp"
#include "sim/world/world.hpp"

namespace nbd {

/// What is wrong with a scene, what may make its motion wrong, and what a run changes before it begins. One
/// line each, JSON path first.
struct SceneFindings {
    std::vector<std::string> problems, warnings, notes;
    std::size_t start_problems = 0;  // the last so many problems are of what intersects at the start
};

/// Checks a scene beyond its text. Problems: bodies that cannot be simulated, trees of other surfaces,
/// regions without nodes or with nodes held by another grip, unusable obstacles, a start that steps refuse
/// although bodies that touch were moved, see judge_start(). Warnings: other faults of the start, and those
/// of scene_body_warnings(). Notes: bodies that are moved. bodies: one per reading.spec.bodies. Bodies and
/// obstacles with problems are left out of the start.
SceneFindings check_scene(const SceneReading& reading, std::span<const LoadedBody> bodies);

/// Moves bodies of a world apart before its first step: all that intersect if the scene asks for it, else
/// those that only touch. Throws as World::resolve_start().
std::vector<StartMove> move_apart(const SceneSpec& spec, World& world);

/// A line about a move. label: of the body.
std::string moved_text(const std::string& label, const StartMove& move);

/// Names of a scene's bodies in messages, as "bodies[1] (cube)".
std::vector<std::string> body_labels(const SceneSpec& spec);

/// What may make the motion of a scene's bodies wrong, see body_hints(), with the scene's scales and
/// materials. One line for all bodies of which the same holds. And a line if spheres among the obstacles are
/// so small that they may pass between the vertices of a body, see vertex_gap(), at rest. bodies: one per
/// spec.bodies.
std::vector<std::string> scene_body_warnings(const SceneSpec& spec, std::span<const LoadedBody> bodies);

/// Lines about bodies whose faces touch at rest, see World::touching_at_rest(). world: of the scene, not
/// moved yet.
std::vector<std::string> rest_warnings(const SceneSpec& spec, World& world);

}  // namespace nbd
