#pragma once

#include "collision/bounds/bound.hpp"
#include "collision/bounds/learned/learned_model.hpp"

namespace nbd {

/// Learned spheres. begin_pose() reads nothing; bound() reads the samples of its node.
class LearnedSpheres {
 public:
    /// model: must outlive this object.
    explicit LearnedSpheres(const LearnedModel& model) : model_(&model) {}

    /// x: must stay valid until the next pose.
    void begin_pose(const Positions& x) noexcept { x_ = x; }
    Sphere bound(int node) noexcept {
        x_.require(model_->node_samples(node));
        const LearnedSphere learned = learned_sphere(*model_, node, x_);
        ood_score_ = learned.ood_score;
        return learned.sphere;
    }
    float ood_score(int) const noexcept { return ood_score_; }

 private:
    const LearnedModel* model_;
    Positions x_;
    float ood_score_ = 0;  // score of the last sphere
};
static_assert(GatedBound<LearnedSpheres>);

}  // namespace nbd
