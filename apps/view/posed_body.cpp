#include "apps/view/posed_body.hpp"

namespace nbd {
namespace {

/// Whether the tree hangs on the nodes that poses give.
bool hangs_on_those_nodes(const BodyTree& body) {
    return body.tree->affine && body.W.rows() > 0 && body.tree->affine->node_count() == body.W.cols();
}

BoundKind drawn_bounds(const BodyTree& body) {
    if (!reads_nodes(body.bounds)) return body.bounds;
    return hangs_on_those_nodes(body) ? BoundKind::affine : BoundKind::boxes;
}

}  // namespace

PosedBody::PosedBody(BodyTree body) : body_(std::move(body)), exact_(body_.tree, BoundKind::boxes) {
    const BoundKind kind = drawn_bounds(body_);
    if (kind != BoundKind::boxes) own_.emplace(body_.tree, kind, body_.margin);
}

void PosedBody::begin_pose(VerticesRef nodes) {
    if (body_.W.rows() > 0)
        apply_embedding(body_.W, nodes, x_);
    else
        x_ = nodes;
    exact_.begin_pose(x_);
    if (!own_) return;
    if (own_->takes_nodes()) {
        nodes_ = nodes;
        own_->begin_pose_of_nodes(nodes_);
    } else {
        own_->begin_pose(x_);
    }
}

}  // namespace nbd
