#pragma once

#include <memory>
#include <variant>
#include <vector>

#include "collision/collision_tree.hpp"

namespace nbd {

/// A body's collision tree in its current pose. Spheres are computed when first asked for in a pose and
/// kept for it; below a leaf a small box tree is refitted on first visit.
class PosedTree {
 public:
    /// margin: every sphere's radius is multiplied by 1 + margin, >= 0. `tree` is shared, not copied.
    /// Throws std::invalid_argument when the tree has no model for `kind` or the margin is out of range.
    PosedTree(std::shared_ptr<const CollisionTree> tree, BoundKind kind, float margin = 0);
    PosedTree(PosedTree&&) noexcept;
    PosedTree& operator=(PosedTree&&) noexcept;
    ~PosedTree();

    /// Starts a pose. x: [vertex_count, 3], world space, metres; referred to, not copied, until the next
    /// call. `exact` visits every vertex here; `bd` and `modal` read their representatives alone.
    void begin_pose(VerticesRef x) noexcept;

    /// World-space sphere of a node in this pose.
    const Sphere& sphere(int node) noexcept;

    /// How many distinct nodes' spheres this pose has computed so far.
    int nodes_bounded() const noexcept;

    const CollisionTree& tree() const noexcept;
    BoundKind kind() const noexcept;

 private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
    friend class PairQuery;
};

}  // namespace nbd
