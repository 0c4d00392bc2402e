#include "apps/view/posed_body.hpp"

#include "collision/tree/make_wide.hpp"

namespace nbd {
namespace {

/// Whether the bounds are those of a tree that hangs on the nodes that poses give.
bool hang_on_those_nodes(const BodyTree& body) {
    return (body.bounds == BoundKind::affine || body.bounds == BoundKind::automatic) && body.tree->affine &&
           body.W.rows() > 0 && body.tree->affine->node_count() == body.W.cols();
}

/// Whether exact boxes stand for bounds of this kind: they find the same faces.
bool boxes_will_do(BoundKind kind) {
    return kind == BoundKind::boxes || kind == BoundKind::affine || kind == BoundKind::automatic;
}

}  // namespace

PosedBody::PosedBody(BodyTree body) : body_(std::move(body)), exact_(body_.tree, BoundKind::boxes) {
    hangs_on_nodes_ = hang_on_those_nodes(body_);
    if (hangs_on_nodes_) wide_.emplace(body_.tree->affine);
    if (boxes_will_do(body_.bounds)) return;
    own_.emplace(body_.tree, body_.bounds, body_.margin);
    if (body_.bounds == BoundKind::learned_affine)
        wide_.emplace(make_wide(*body_.tree, body_.bounds, body_.margin));
}

void PosedBody::begin_pose(VerticesRef nodes) {
    if (body_.W.rows() > 0)
        apply_embedding(body_.W, nodes, x_);
    else
        x_ = nodes;
    exact_.begin_pose(x_);
    if (own_) own_->begin_pose(x_);
    if (hangs_on_nodes_) nodes_ = nodes;
    if (wide_) wide_->begin_pose(hangs_on_nodes_ ? nodes_ : x_);
}

}  // namespace nbd
