#include "apps/view/posed_body.hpp"

namespace nbd {
namespace {

/// Whether exact boxes stand for bounds of this kind: they find the same faces.
bool boxes_will_do(BoundKind kind) {
    return kind == BoundKind::boxes || kind == BoundKind::affine || kind == BoundKind::automatic;
}

}  // namespace

PosedBody::PosedBody(BodyTree body) : body_(std::move(body)), exact_(body_.tree, BoundKind::boxes) {
    if (boxes_will_do(body_.bounds)) return;
    own_.emplace(body_.tree, body_.bounds, body_.margin);
    if (body_.bounds == BoundKind::certified && body_.solid.X.rows() > 0)
        meter_.emplace(body_.solid, std::make_shared<const TetRegions>(body_.tree->certified->regions));
}

void PosedBody::begin_pose(VerticesRef nodes) {
    if (body_.W.rows() > 0)
        apply_embedding(body_.W, nodes, x_);
    else
        x_ = nodes;
    exact_.begin_pose(x_);
    if (own_) own_->begin_pose(x_, meter_ ? meter_->measure(nodes) : std::span<const RegionMotion>());
}

}  // namespace nbd
