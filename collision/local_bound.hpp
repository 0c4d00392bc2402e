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
    void begin_pose(VerticesRef x) noexcept { pose_ = x; }
    Sphere bound(int node) noexcept {
        const LocalSphere local = local_sphere(*model_, node, pose_);
        strangeness_ = local.strangeness;
        return local.sphere;
    }
    float strangeness(int) const noexcept { return strangeness_; }
    Box box(int node) const noexcept { return local_box(*model_, node, pose_); }

 private:
    const LocalModel* model_;
    PoseView pose_;
    float strangeness_ = 0;  // of the last sphere
};
static_assert(GatedBound<LocalBound>);

}  // namespace nbd
