#pragma once

#include <memory>
#include <optional>

#include "collision/nbd_tree/posed_nbd_tree.hpp"
#include "collision/tree/collision_tree.hpp"
#include "collision/wide_tree/posed_wide_tree.hpp"

namespace nbd {

/// A body's collision tree in its current pose: an NBD-Tree for `exact`, `bd` and `nbd` bounds, a wide tree
/// for all others. What a query looks at is computed on first use in a pose and cached. Beside a body of the
/// other form, with itself and for closest points, a body with an NBD-Tree has exact boxes of a wide tree.
/// Before its first pose a body touches nothing. Reading writes these caches, so only one thread at a time
/// may use a tree.
///
/// `auto` bounds are those of bounds_of_auto() (auto_bounds.hpp).
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

    /// Starts a pose. x: [vertex_count, 3], world space, metres, finite; not copied, so the array must stay
    /// valid until the next call. `exact` and `boxes` read every vertex here, `bd` and `nbd` only their
    /// representatives, `learned_affine` the samples of its clusters. Queries later read the samples of other
    /// learned nodes, and all vertices of nodes that are out of range. In such a pose `affine` bodies have
    /// `boxes`.
    ///
    /// This and the functions below that start a pose throw std::invalid_argument if the numbers of rows do
    /// not fit the tree, or a number that they read is not finite; representatives are checked with the first
    /// sphere that a query makes from them. What they do not read, the queries check when they read it; they
    /// throw likewise, and leave alone what has no part in their answer. All of them throw std::bad_alloc if
    /// memory runs out. After an error the body has no pose, as before the first one, and may be given
    /// another.
    void begin_pose(VertexView x);

    /// Starts a pose of a body that takes_nodes(), and only of such a one. nodes: [node_count, 3], world
    /// space, metres, finite; valid until the next call, likewise.
    void begin_pose_of_nodes(VertexView nodes);

    /// Starts a step of linear motion, for continuous collision detection: every vertex moves straight from
    /// its position in `start` to that in `end`, like x of begin_pose(). whole() and the boxes_within() of
    /// all queries then answer for the whole step: they leave out no faces that are within the distance at
    /// any one time of it. Boxes of a wide tree are exact in a step of positions. A node of an NBD-Tree has
    /// the smallest sphere around those of its poses at both ends, each with its margin and its exact bound
    /// where out of range; so queries between two such bodies miss what the bounds miss at an end. A body in
    /// a pose beside one in a step does not move. All else, but sphere(), sees the pose at the end.
    ///
    /// Both arrays are read like that of a pose; positions of both ends are checked likewise.
    void begin_step(VertexView start, VertexView end);

    /// Likewise from the nodes at both ends, for a body that takes_nodes().
    void begin_step_of_nodes(VertexView start, VertexView end);

    /// Makes room for poses in which queries read all of this body. Such poses and queries then allocate
    /// nothing in it; else they do where they read more than any before. About 1.3 kB for each leaf of its
    /// trees of boxes, which hold up to 16 faces; with an NBD-Tree, also a second set of spheres for steps.
    void reserve();

    /// Whether the nodes that carry the surface are all that the body reads, where poses give them: for
    /// `affine` bounds, and for `auto` ones of a tree that hangs on nodes. Poses may give positions instead.
    bool takes_nodes() const noexcept { return of_nodes_.has_value(); }
    bool has_pose() const noexcept;

    /// World-space sphere of a node in this pose or over this step; its rest sphere before the first one. Not
    /// finite where the node's positions are not. Throws std::invalid_argument if the body has no NBD-Tree.
    const Sphere& sphere(int node);

    /// Box around the whole body in this pose or step, as its bounds have it: that of the root, or around its
    /// sphere; empty_box() before the first pose. Throws std::invalid_argument if it is made from numbers
    /// that are not finite.
    Box whole();

    /// Number of distinct nodes bounded so far in this pose. In a step a node of an NBD-Tree counts twice, in
    /// both numbers: once for each end.
    int nodes_bounded() const noexcept;
    /// How many of these were bounded exactly because their input was out of the calibrated range.
    int nodes_out_of_range() const noexcept;

    const CollisionTree& tree() const noexcept { return *tree_; }
    BoundKind kind() const noexcept { return kind_; }
    /// The bounds in this pose or step: kind(), or what `auto` chose; for wide trees, `boxes` in a step of
    /// positions, and of `affine` bodies in their pose.
    BoundKind chosen() const noexcept;
    /// The wide tree in this pose, for bounds that have one, except `auto`; null for others. Before the first
    /// pose, as in the poses that the bounds are for.
    const WideTree* box_tree() const noexcept;

    /// What queries walk. The NBD-Tree in this pose or step; null if the body has none.
    PosedNbdTree* nbd_tree() noexcept { return spheres_ ? &*spheres_ : nullptr; }
    /// The wide tree in this pose or step. A body with an NBD-Tree makes one, and reads all positions, when
    /// it is first asked for.
    PosedWideTree& wide_tree();

    /// Room that walks of its wide trees may need: packs of clusters, and leaves.
    struct WideRoom {
        int packs = 0, leaves = 0;
    };
    WideRoom wide_room() const noexcept;

 private:
    /// Calls start(), which begins a pose or a step. If it throws, or read what is not finite, there is no
    /// pose, and the error goes on.
    template <class Start>
    void begin(const Start& start);
    /// Calls start(tree) of the tree that queries walk where positions are given. No other one has a pose.
    template <class Start>
    void begin_positions(const Start& start);
    void forget_pose() noexcept;
    void check_rows(const char* what, const VertexView& x) const;
    void check_nodes(const char* what, const VertexView& x) const;
    void require_finite() const;
    PosedWideTree& surface_boxes();
    /// Whether the wide tree in this pose is of_surface_. Before the first pose: in the poses that the bounds
    /// are for.
    bool is_moved_by_positions() const noexcept {
        return of_surface_ && (of_surface_->has_pose() || !of_nodes_);
    }
    const std::optional<PosedWideTree>& current_wide_tree() const noexcept {
        return is_moved_by_positions() ? of_surface_ : of_nodes_;
    }

    std::shared_ptr<const CollisionTree> tree_;
    BoundKind kind_;
    std::optional<float> margin_;
    std::optional<PosedNbdTree> spheres_;      // for bounds that are spheres
    std::optional<PosedWideTree> of_nodes_;    // of a body that takes nodes
    std::optional<PosedWideTree> of_surface_;  // moved by positions; empty until it is needed
};

}  // namespace nbd
