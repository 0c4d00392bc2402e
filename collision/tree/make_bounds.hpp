#pragma once

#include <memory>
#include <optional>

#include "collision/tree/posed_spheres.hpp"

namespace nbd {

/// Throws std::invalid_argument, saying what to do, if a tree has the bounds but they are not usable: nodes
/// would miss at no stated rate. `auto` takes other bounds then.
void check_calibrated(const CollisionTree& tree, BoundKind kind, std::optional<float> margin);

/// The sphere tree with bounds of this kind. Throws std::invalid_argument if the tree has no model for them.
std::unique_ptr<PosedSpheres> make_spheres(const CollisionTree& tree, BoundKind kind,
                                           std::optional<float> margin);

}  // namespace nbd
