#include "training/evaluate/contact_placement.hpp"

namespace nbd {
namespace {

FrameId draw_other(std::span<const FrameId> frames, FrameId first, CounterRandom& random) {
    const bool several = frames.front().trajectory != frames.back().trajectory;
    for (;;) {
        const FrameId frame = frames[random.index(frames.size())];
        if (!several || frame.trajectory != first.trajectory) return frame;
    }
}

}  // namespace

ContactPlacement draw_contact_placement(std::span<const FrameId> frames, CounterRandom& random) {
    ContactPlacement placement;
    placement.first = frames[random.index(frames.size())];
    placement.second = draw_other(frames, placement.first, random);
    placement.turn = random.orientation().toRotationMatrix().cast<float>();
    placement.from = random.direction().cast<float>().transpose();
    return placement;
}

Approach::Approach(const std::shared_ptr<const CollisionTree>& tree)
    : a_(tree, BoundKind::exact), b_(tree, BoundKind::exact) {}

void Approach::start(const Vertices& a, const Vertices& b, const Eigen::RowVector3f& from) {
    first_ = a;
    turned_ = b;
    from_ = from;
    a_.begin_pose(first_);
}

std::span<const FacePair> Approach::pairs_at(float distance) {
    placed_ = turned_.rowwise() + distance * from_;
    b_.begin_pose(placed_);
    return query_.intersecting(a_, b_);
}

float Approach::touching_distance() {
    float near = 0, far = first_.rowwise().norm().maxCoeff() + turned_.rowwise().norm().maxCoeff();
    for (int i = 0; i < 12; ++i) {
        const float middle = 0.5f * (near + far);
        (pairs_at(middle).empty() ? far : near) = middle;
    }
    return near;
}

}  // namespace nbd
