#pragma once

#include <memory>
#include <optional>

#include "collision/bounds/affine/affine_boxes.hpp"
#include "collision/geometry/embedding.hpp"
#include "collision/tree/posed_tree.hpp"

namespace nbd {

/// The bounds of a body as a page asks for them.
struct BodyTree {
    std::shared_ptr<const CollisionTree> tree;
    SurfaceEmbedding W{};  // [n, N] surface vertices from nodes; empty: the nodes are the vertices
    BoundKind bounds = BoundKind::boxes;
    std::optional<float> margin{};  // see PosedTree
};

/// A body in a pose, with exact bounds and its own.
class PosedBody {
 public:
    /// Throws std::invalid_argument if the tree has no such bounds.
    explicit PosedBody(BodyTree body);

    /// nodes: [N, 3]; not referred to afterwards.
    void begin_pose(VerticesRef nodes);

    const Vertices& x() const noexcept { return x_; }  // [n, 3] surface
    const CollisionTree& tree() const noexcept { return *body_.tree; }
    PosedTree& exact() noexcept { return exact_; }
    /// With its own bounds where these can miss, else with exact ones.
    PosedTree& searched() noexcept { return misses() ? *own_ : exact_; }
    /// The boxes of the wide tree that `affine` bounds walk, `auto` ones where they are the same, and
    /// `learned_affine` ones; null for others.
    AffineBoxes* wide() noexcept { return wide_ ? &*wide_ : nullptr; }
    /// With the bounds that a page draws of a body without wide().
    PosedTree& drawn() noexcept { return own_ ? *own_ : exact_; }
    bool misses() const noexcept { return can_miss(body_.bounds); }

 private:
    BodyTree body_;
    Vertices x_;
    PosedTree exact_;
    std::optional<PosedTree> own_;  // empty: the exact boxes
    bool hangs_on_nodes_ = false;   // wide_ is posed by nodes_
    Vertices nodes_;
    std::optional<AffineBoxes> wide_;
};

}  // namespace nbd
