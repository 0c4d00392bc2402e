#pragma once

#include <memory>
#include <optional>
#include <span>

#include "collision/geometry/box.hpp"
#include "collision/tree/collision_tree.hpp"

namespace nbd {

class EmbeddedPositions;
struct PosedTreeState;

/// A body's collision tree in its current pose. Spheres are computed when first asked for in a pose and
/// kept for it; below a leaf a small box tree is refitted on first visit. Until the first pose nothing
/// touches it. Reading it writes those caches: one thread at a time.
class PosedTree {
 public:
    /// margin: every sphere's radius is multiplied by 1 + margin, >= 0, or every side of a learned box moves
    /// outward by as many spreads of its samples, and no node is bounded otherwise.
    /// Without one, what the tree's calibration of these bounds says: a margin for each node, and exact
    /// spheres where the input is out of range; where there is none, as margin 0. `tree` is shared, not
    /// copied.
    /// Throws std::invalid_argument when the tree's parts do not fit each other (check_collision_tree), it
    /// has no model for `kind`, or the margin is out of range.
    PosedTree(std::shared_ptr<const CollisionTree> tree, BoundKind kind, std::optional<float> margin = {});
    PosedTree(PosedTree&&) noexcept;
    PosedTree& operator=(PosedTree&&) noexcept;
    ~PosedTree();

    /// Starts a pose. x: [vertex_count, 3], world space, metres, finite; referred to, not copied, until the
    /// next call, so it must be an array that lasts (not an expression that makes one). `exact` visits every
    /// vertex here; `bd` and `modal` read their representatives alone, `local` nothing. Later the samples of
    /// `local` nodes are read, and all vertices of nodes that are out of range.
    /// motion: for `certified`, one a region of the tree's model, lasting as x; without it that kind takes
    /// the exact sphere of every node. The others ignore it.
    void begin_pose(VerticesRef x, std::span<const RegionMotion> motion = {}) noexcept;

    /// Likewise with positions that are computed where they are read: all of them for `exact` and `boxes`,
    /// few for the others. x: its pose has begun; referred to until the next call.
    void begin_pose(EmbeddedPositions& x, std::span<const RegionMotion> motion = {}) noexcept;

    /// World-space sphere of a node in this pose; of bounds that are boxes, the one around the box.
    const Sphere& sphere(int node) noexcept;

    /// World-space box of a node in this pose; nothing for bounds that are spheres.
    std::optional<Box> box(int node) noexcept;

    /// How far a node's input in this pose lies from the training's, see GatedBound; nothing for bounds that
    /// do not know.
    std::optional<float> ood_score(int node) noexcept;

    /// How many distinct nodes' spheres this pose has computed so far.
    int nodes_bounded() const noexcept;
    /// And how many of them exactly, since their input was out of the calibrated range.
    int nodes_out_of_range() const noexcept;

    const CollisionTree& tree() const noexcept;
    BoundKind kind() const noexcept;

 private:
    std::unique_ptr<PosedTreeState> state_;
    friend class ClosestQuery;
    friend class PairQuery;
};

}  // namespace nbd
