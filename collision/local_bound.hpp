#pragma once

#include "collision/bound.hpp"
#include "collision/local_model.hpp"

namespace nbd {

/// Local bounds of a pose. begin_pose() costs nothing: a node reads its own samples when it is asked for.
class LocalBound {
 public:
    /// model: referred to.
    explicit LocalBound(const LocalModel& model) : model_(&model) {}

    /// x: referred to until the next pose.
    void begin_pose(const Positions& x) noexcept { x_ = x; }
    Sphere bound(int node) noexcept {
        x_.require(model_->node_samples(node));
        const LocalSphere local = local_sphere(*model_, node, x_);
        strangeness_ = local.strangeness;
        return local.sphere;
    }
    float strangeness(int) const noexcept { return strangeness_; }

 private:
    const LocalModel* model_;
    Positions x_;
    float strangeness_ = 0;  // of the last sphere
};
static_assert(GatedBound<LocalBound>);

}  // namespace nbd
