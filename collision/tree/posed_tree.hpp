#pragma once

#include <memory>
#include <optional>

#include "collision/geometry/box.hpp"
#include "collision/geometry/vertex_view.hpp"
#include "collision/tree/collision_tree.hpp"

namespace nbd {

class EmbeddedPositions;
class Positions;
struct PosedTreeState;

/// A body's collision tree in its current pose. Each sphere is computed on first use in a pose and cached;
/// the small box tree below a leaf is refitted on first visit. A body with `affine` or `learned_affine`
/// bounds or `boxes` has a box tree instead, and makes the sphere tree, from all positions of its surface,
/// only when a query with a body of another kind, or a question about a node, needs it. Before its first pose
/// a body touches nothing. Reading writes these caches, so only one thread at a time may use a tree.
///
/// `auto` bounds are those of bounds_of_auto(), or exact boxes with a body that has spheres.
class PosedTree {
 public:
    /// `tree` is shared, not copied. margin: finite, >= 0. It multiplies the radius of every sphere by
    /// 1 + margin, or moves every side of a learned box outward by margin times the spread of its samples, or
    /// their residual for those that follow an affine map; no node falls back to an exact bound. Without a
    /// margin, the tree's calibration of these bounds applies: a margin per node, and exact bounds where the
    /// input is out of range. Bounds that can miss need one of the two; `auto` takes none that have neither.
    /// Throws std::invalid_argument if the tree's parts do not fit each other (check_collision_tree), it has
    /// no model for `kind`, no calibration of bounds that can miss and no margin is given, or the margin is
    /// out of range.
    PosedTree(std::shared_ptr<const CollisionTree> tree, BoundKind kind, std::optional<float> margin = {});
    PosedTree(PosedTree&&) noexcept;
    PosedTree& operator=(PosedTree&&) noexcept;
    ~PosedTree();

    /// Starts a pose. x: [vertex_count, 3], world space, metres, finite; not copied, so the array must stay
    /// valid until the next call. `exact` and `boxes`
    /// read every vertex here, `bd` and `nbd` read only their representatives, `learned_affine` nothing.
    /// Queries later read the samples of learned nodes, and all vertices of nodes that are out of range.
    /// In such a pose `affine` bodies have `boxes`.
    ///
    /// This and the functions below that start a pose throw std::invalid_argument if the numbers of rows do
    /// not fit the tree, or a number that they read is not finite. What they do not read, the
    /// queries check when they read it; they throw likewise, and leave alone what has no part in their
    /// answer. All of them throw std::bad_alloc if memory runs out. After an error the body has no pose, as
    /// before the first one, and may be given another.
    void begin_pose(VertexView x);

    /// Starts a pose with positions that are computed on demand: all of them for `exact` and `boxes`, which
    /// copy them once more, and for `learned_affine`, few for the other kinds. x: its begin_pose() was
    /// called; must stay valid until the next call. `affine` bounds, and `auto` ones with an affine model,
    /// take the nodes alone, by which the tree hangs as it was made: x must be of the same W.
    void begin_pose(EmbeddedPositions& x);

    /// Starts a pose of a body with `affine` bounds, or with `auto` ones and an affine model, and only of
    /// such a one: it reads the nodes that carry the surface. nodes: [node_count, 3], world space, metres,
    /// finite; valid until the next call, likewise.
    void begin_pose_of_nodes(VertexView nodes);

    /// Starts a step of linear motion, for continuous collision detection: every vertex moves straight from
    /// its position in `start` to that in `end`, like x of begin_pose(). whole() and the boxes_within() of
    /// all queries then answer for the whole step: they leave out no faces that are within the distance at
    /// any one time of it. A body with `boxes` or `affine` bounds in a pose is one that does not move. All
    /// else sees the pose at the end. Bodies with spheres get the exact boxes of `boxes` in a step; in a
    /// pose boxes_within() refuses them beside a body in a step.
    void begin_step(VertexView start, VertexView end);

    /// Likewise from the nodes at both ends, for a body as begin_pose_of_nodes() takes it.
    void begin_step_of_nodes(VertexView start, VertexView end);

    /// Makes room for poses in which queries with bodies of its kind read all of this body. Such poses and
    /// queries then allocate nothing in it; else they do where they read more than any before, as does the
    /// first query with a body whose bounds are of another form. About 1.3 kB for each of the tree's leaves,
    /// which hold up to 16 faces; nothing for bounds without a box tree.
    void reserve();

    /// World-space sphere of a node in this pose; for bounds that are boxes, the sphere around the box. Not
    /// finite where the node's positions are not.
    const Sphere& sphere(int node);

    /// World-space box of a node in this pose; empty for bounds that are spheres.
    std::optional<Box> box(int node);

    /// Box around the whole body in this pose, as its bounds have it: that of the root, or around its sphere;
    /// empty_box() before the first pose.
    /// Throws std::invalid_argument if it is made from numbers that are not finite.
    Box whole();

    /// Out-of-distribution score of a node's input in this pose, see GatedBound; empty for bounds without
    /// one, and where there is no pose.
    std::optional<float> ood_score(int node);

    /// Number of distinct nodes bounded so far in this pose.
    int nodes_bounded() const noexcept;
    /// How many of these were bounded exactly because their input was out of the calibrated range.
    int nodes_out_of_range() const noexcept;

    const CollisionTree& tree() const noexcept;
    /// The tree of the boxes in this pose, for bounds that are walked down a box tree, except `auto`; null
    /// for others. Before the first pose, as in the poses that the bounds are for.
    const WideTree* box_tree() const noexcept;
    BoundKind kind() const noexcept;
    /// The bounds that the last query of pairs used: kind(), or what `auto` chose.
    BoundKind chosen() const noexcept;

 private:
    std::unique_ptr<PosedTreeState> state_;
    friend class ClosestQuery;
    friend class PairQuery;
    friend class SelfQuery;
};

}  // namespace nbd
