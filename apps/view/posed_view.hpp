#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "apps/view/view_scene.hpp"
#include "collision/geometry/embedding.hpp"
#include "collision/tree/posed_tree.hpp"
#include "collision/wide_tree/posed_wide_tree.hpp"

namespace nbd {

/// The bounds of a body as a page asks for them.
struct ViewTree {
    std::shared_ptr<const CollisionTree> tree;
    SurfaceEmbedding W{};  // [n, N] surface vertices from nodes; empty: the nodes are the vertices
    BoundKind bounds = BoundKind::boxes;
    std::optional<float> margin{};  // see PosedTree
};

/// A body in a pose, with exact bounds and its own.
class PosedView {
 public:
    /// Throws std::invalid_argument if the tree has no such bounds.
    explicit PosedView(ViewTree body);

    /// nodes: [N, 3]; not referred to afterwards.
    void begin_pose(VerticesRef nodes);

    const Vertices& x() const noexcept { return x_; }  // [n, 3] surface
    const CollisionTree& tree() const noexcept { return *body_.tree; }
    PosedTree& exact() noexcept { return exact_; }
    /// With its own bounds, which a page draws and whose misses it counts. `auto` ones are `affine` where the
    /// poses give the nodes on which the tree hangs, and exact boxes elsewhere, as `affine` ones are.
    PosedTree& own() noexcept { return own_ ? *own_ : exact_; }
    bool misses() const noexcept { return can_miss(body_.bounds); }

 private:
    ViewTree body_;
    Vertices x_, nodes_;
    PosedTree exact_;
    std::optional<PosedTree> own_;  // empty: the exact boxes
};

/// Bounds to which add_bounds() adds: spheres of the nodes down to depth 6, or boxes of levels of the wide
/// tree, 512 at most.
ViewBounds bounds_of(PosedView& body);

/// Appends the bounds of a frame. body: in its pose.
void add_bounds(PosedView& body, ViewBounds& bounds);

/// The boxes in a pose, level by level from the whole body down to leaves of some faces: as many levels as
/// have `most` boxes together, the first one always.
std::vector<std::vector<Box>> box_levels(PosedWideTree& boxes, std::size_t most);

}  // namespace nbd
