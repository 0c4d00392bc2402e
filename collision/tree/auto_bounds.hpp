#pragma once

#include <optional>

#include "collision/tree/collision_tree.hpp"

namespace nbd {

/// What `auto` bounds are: the fastest of these in the races of apps/docs/speed.md, and exact where learned
/// ones win little.
/// - `affine` if the pose is given by the nodes that carry the surface and the tree hangs on them.
/// - Else `learned_affine` if the tree has 100,000 faces or more, and such bounds that are usable.
/// - Else `boxes`.
BoundKind bounds_of_auto(const CollisionTree& tree, bool by_nodes, std::optional<float> margin) noexcept;

/// For `auto`, exact bounds in its place, where nothing may be missed: `affine` if the tree has a model for
/// them, else `boxes`. Returns other kinds unchanged.
BoundKind exact_for_auto(const CollisionTree& tree, BoundKind kind) noexcept;

}  // namespace nbd
