#pragma once

#include <memory>
#include <optional>

#include "collision/bounds/affine/affine_boxes.hpp"
#include "collision/tree/posed_spheres.hpp"
#include "collision/tree/posed_tree.hpp"

namespace nbd {

/// The data of a PosedTree, visible to the queries. It has a wide tree, a sphere tree or both, and each
/// begins a pose when it is first needed.
struct PosedTreeState {
    std::shared_ptr<const CollisionTree> tree;
    BoundKind kind;
    std::optional<float> margin{};
    std::unique_ptr<PosedSpheres> posed_spheres{};        // null: not needed so far
    std::optional<AffineBoxes> of_nodes{}, of_surface{};  // wide trees; empty: not needed so far
    bool is_wide = false;               // has the bounds of a wide tree, perhaps among others
    Positions positions{};              // of the pose
    VertexView given{}, given_start{};  // what the pose or step was given by: positions or nodes
    bool given_nodes = false;           // it was nodes
    Vertices surface{};                 // `positions` that were made from nodes
    bool is_of_nodes = false;           // the pose or step was given by nodes
    bool in_step = false;               // a step, whose end is the pose
    bool wide_is_stale = false;         // of_surface has another pose
    bool spheres_are_stale = false;     // posed_spheres has another pose
    bool goes_wide = false;             // the last query walked the wide trees

    PosedTreeState(std::shared_ptr<const CollisionTree> body, BoundKind bounds, std::optional<float> growth);

    /// Start a pose or a step, see PosedTree, and check what they read.
    void begin_pose(VertexView x);
    void begin_pose(EmbeddedPositions& x);
    void begin_pose_of_nodes(VertexView nodes);
    void begin_step(VertexView start, VertexView end);
    void begin_step_of_nodes(VertexView start, VertexView end);

    /// Throws std::invalid_argument, naming the first vertex or node, if a number that was read in this pose
    /// so far is not finite. Queries call it before they answer.
    void require_finite() const;

    bool has_pose() const noexcept { return given.count() > 0; }
    /// Whether there is wide(): by the body's kind, or in a step.
    bool has_wide() const noexcept { return is_wide || in_step; }
    /// The boxes of the wide tree in this pose.
    AffineBoxes& wide();
    /// The bounds of of_surface.
    BoundKind of_positions() const noexcept {
        return kind == BoundKind::automatic ? bounds_of_auto(*tree, false, margin) : kind;
    }
    /// The sphere tree in this pose. For `boxes` and `affine` it has exact boxes, and reads the whole
    /// surface.
    PosedSpheres& spheres();

 private:
    /// Calls start(), which begins a pose or a step. If it throws, or read what is not finite, there is no
    /// pose, and the error goes on.
    template <class Start>
    void begin(const Start& start);
    void forget_pose() noexcept;
    PosedSpheres& made_spheres();  // in whatever pose
    void set_pose(const Positions& x);
    bool met_non_finite() const noexcept;
    void check_rows(const char* what, const VertexView& x) const;
    void check_nodes(const char* what, const VertexView& x) const;
};

/// Begins a query between two bodies, or with one alone. Returns whether it walks the bodies' wide trees;
/// else it walks their sphere trees.
bool walk_wide_trees(PosedTreeState& a, PosedTreeState& b) noexcept;

}  // namespace nbd
