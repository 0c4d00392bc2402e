#pragma once

#include <optional>

#include "collision/bounds/affine/affine_boxes.hpp"
#include "collision/bounds/node_margins.hpp"
#include "collision/tree/collision_tree.hpp"

namespace nbd {

/// The margins of bounds of a kind, as PosedTree takes them: those of the calibration unless one is given.
NodeMargins node_margins(const CollisionTree& tree, BoundKind kind, std::optional<float> margin);

/// The wide tree that a surface's positions move: exact, or learned where `kind` is `learned_affine`, for
/// which the tree has a model.
AffineBoxes make_wide(const CollisionTree& tree, BoundKind kind, std::optional<float> margin);

}  // namespace nbd
