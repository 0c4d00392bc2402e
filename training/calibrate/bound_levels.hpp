#pragma once

#include <vector>

#include "collision/tree/collision_tree.hpp"

namespace nbd {

/// The levels of a kind's bounds, which are numbered level after level. Of most kinds they are the depths of
/// the sphere tree.
struct BoundLevels {
    std::vector<int> begins;  // first bound of each level, then the number of bounds

    BoundLevels(const SphereTree& tree);  // NOLINT: a tree stands for its depths
    BoundLevels(const CollisionTree& tree, BoundKind kind);

    int count() const noexcept { return static_cast<int>(begins.size()) - 1; }
};

}  // namespace nbd
