#pragma once

#include <memory>
#include <optional>

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
    /// With the bounds that a page draws. `auto` ones are `affine` where the poses give the nodes on which
    /// the tree hangs, and exact boxes elsewhere, as `affine` ones are.
    PosedTree& drawn() noexcept { return own_ ? *own_ : exact_; }
    bool misses() const noexcept { return can_miss(body_.bounds); }

 private:
    BodyTree body_;
    Vertices x_, nodes_;
    PosedTree exact_;
    std::optional<PosedTree> own_;  // empty: the exact boxes
};

}  // namespace nbd
