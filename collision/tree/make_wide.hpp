#pragma once

#include <optional>

#include "collision/bounds/affine/affine_boxes.hpp"
#include "collision/tree/collision_tree.hpp"

namespace nbd {

/// The wide tree that a surface's positions move: exact, or learned where `kind` is `learned_affine`, for
/// which the tree has a model.
AffineBoxes make_wide(const CollisionTree& tree, BoundKind kind, std::optional<float> margin);

}  // namespace nbd
