#pragma once

#include <array>
#include <memory>

#include "collision/bounds/affine/learned_affine_model.hpp"
#include "collision/bounds/node_margins.hpp"
#include "collision/kernels/box_pack.hpp"

namespace nbd {

/// Learned affine boxes in a pose, as calibrated. A part whose samples are out of the calibrated range has
/// none: its exact boxes are to be taken.
class LearnedAffineBoxes {
 public:
    /// margins: of model->bounds(), those of clusters in spreads and those of parts in residuals.
    LearnedAffineBoxes(std::shared_ptr<const LearnedAffineModel> model, NodeMargins margins);

    /// x: positions, three numbers each; must stay valid until the next pose.
    void begin_pose(const float* x) noexcept {
        x_ = x;
        out_of_range_ = 0;
        met_non_finite_ = false;
    }

    /// Box of a cluster; boxes of its blocks; boxes of a block's leaves. Return false, and nothing in the
    /// box, if the samples are out of range.
    bool box(int cluster, Box& box) noexcept;
    bool blocks(int cluster, BoxPack& boxes) noexcept { return children(cluster, boxes); }
    bool leaves(int block, BoxPack& boxes) noexcept { return children(model_->clusters() + block, boxes); }

    /// Prefetch what these will read.
    void prefetch_box(int cluster) const noexcept { model_->prefetch_samples(cluster, x_); }
    void prefetch_blocks(int cluster) const noexcept { model_->prefetch_part(cluster); }
    void prefetch_leaves(int block) const noexcept { model_->prefetch_part(model_->clusters() + block); }

    /// Number of bounds in this pose that were out of range.
    int out_of_range() const noexcept { return out_of_range_; }
    /// Whether a sample that was read in this pose was not finite.
    bool met_non_finite() const noexcept { return met_non_finite_; }

 private:
    bool children(int part, BoxPack& boxes) noexcept;
    /// Margin of a bound for this score; negative if it is out of range.
    float margin(int bound, float ood_score) noexcept;

    std::shared_ptr<const LearnedAffineModel> model_;
    NodeMargins margins_;
    const float* x_ = nullptr;
    int out_of_range_ = 0;
    bool met_non_finite_ = false;
    alignas(64) std::array<float, LearnedAffineModel::scratch> scratch_{};
};

}  // namespace nbd
