#pragma once

#include <string>

#include "sim/scene/scene.hpp"

namespace nbd {

/// Name of a body of a scene, or "bodies[1]" if others have it, too.
std::string unique_name(const SceneSpec& spec, int body);

/// "grip" (pins among them), "driven", "obstacle" or "body".
const char* name(ReactionBy by) noexcept;

/// What exerts a reaction, as the scene names it: "pins[0]" or "grips[1]" of the body that it acts on, an
/// obstacle, or another body; "driven" for what drives nodes.
std::string reaction_name(const SceneSpec& spec, const Reaction& reaction);

}  // namespace nbd
