#pragma once

#include <array>
#include <cmath>
#include <memory>
#include <span>
#include <vector>

#include "collision/bounds/calibration.hpp"
#include "collision/geometry/box.hpp"
#include "collision/geometry/geometry.hpp"
#include "collision/kernels/box_pack.hpp"
#include "collision/wide_tree/affine_parts.hpp"
#include "collision/wide_tree/wide_tree.hpp"

namespace nbd {

/// How far the vertices of a patch reach beyond the box of a few of them, its samples, in units of the
/// samples' spread: the root mean square of their distances from their mean, which grows as the patch
/// stretches.
struct BoxFit {
    float growth = 0;             // each side of the box moves outward by growth * spread
    float mean = 0;               // mean of spread^2 in training, m^2
    float inverse_deviation = 0;  // 1 / standard deviation of spread^2 in training, m^-2

    /// Distance of spread^2, m^2, from its mean in training, in standard deviations.
    float ood_score(float squared_spread) const noexcept {
        return std::abs(squared_spread - mean) * inverse_deviation;
    }
};

/// What training finds for learned affine boxes. A part is a cluster or a block of a wide tree; the clusters
/// come first, each level in the order of the tree.
struct LearnedAffineFit {
    static constexpr int samples_per_part = 32, samples_per_box = 16;

    Vertices X;                // rest positions of the surface, [n, 3]
    std::vector<int> samples;  // [parts * samples_per_part] vertices; smaller parts repeat theirs
    /// [clusters * samples_per_box] vertices that stand out; smaller clusters repeat theirs.
    std::vector<int> box_samples;
    std::vector<BoxFit> clusters;  // of the box samples
    /// [parts] root mean square of the part's residual in training, metres, > 0.
    std::vector<float> residual;
    /// [parts * 16] how far the box of each child moves outward, in residuals; 0 for children not present.
    std::vector<float> growth;
};

/// Box of the samples of a cluster's box and their spread, metres.
struct ClusterSamples {
    Box box;
    float spread = 0;
};

/// The model of learned affine boxes: boxes of the parts of a wide tree from a few sampled vertices of each,
/// for surfaces of which positions alone are known. A cluster's own box is that of samples of its own, grown
/// as trained. A part's children are bounded by the affine map that fits its samples best: their rest boxes
/// move with the map, widen by what the map leaves at the nearest samples, and grow by a trained multiple of
/// the residual, the root mean square of what it leaves at all samples. Vertices that are not sampled may lie
/// outside, at a rate that calibration states.
class LearnedAffineModel {
 public:
    static constexpr int carriers = 8;  // samples near a child that widen its box

    /// tree: of the surface. Throws std::invalid_argument, saying what is wrong, unless the fit is of this
    /// tree.
    LearnedAffineModel(const WideTree& tree, LearnedAffineFit fit);

    const LearnedAffineFit& fit() const noexcept { return fit_; }
    int clusters() const noexcept { return fit_.clusters.size(); }
    int parts() const noexcept { return parts_of_; }
    /// Number of bounds that have a margin and a limit of their own: the boxes of clusters, then for each
    /// part the boxes of its children together.
    int bounds() const noexcept { return clusters() + parts(); }
    /// First bound of each level, and their number: boxes of clusters, of blocks, of leaves.
    std::vector<int> levels() const { return {0, clusters(), 2 * clusters(), bounds()}; }

    /// Numbers that map_children() needs as scratch.
    static constexpr int scratch = 3 * LearnedAffineFit::samples_per_part;

    /// Samples of a cluster in a pose, before growth. x: positions, three numbers each.
    ClusterSamples cluster_samples(int cluster, const float* x) const noexcept;
    /// Boxes of a part's children in a pose, before growth. Returns the residual, metres.
    float map_children(int part, const float* x, float* scratch, BoxPack& boxes) const noexcept;
    /// Out-of-distribution scores, see GatedBound: distance of spread^2 from its mean in training, in
    /// standard deviations, and a residual over that of training.
    float cluster_score(int cluster, float spread) const noexcept;
    float part_score(int part, float residual) const noexcept { return residual / fit_.residual[part]; }
    /// Moves the sides of the boxes of a part's children outward by growth plus a margin, both in residuals.
    void grow(int part, float margin, float residual, BoxPack& boxes) const noexcept;

    /// How far the children of a part protrude from their boxes before growth, lane by lane; negative for
    /// boxes with room to spare, and for children that are not present. exact: boxes in the pose. Metres.
    std::array<float, tree_width> protrusions(int part, const BoxPack& boxes, const WideTree& tree,
                                              const WideBoxes& exact) const noexcept;

    /// Prefetch the positions that cluster_samples() reads, and all but positions that map_children() reads.
    void prefetch_samples(int cluster, const float* x) const noexcept;
    void prefetch_part(int part) const noexcept { maps_.prefetch(part); }

    std::size_t bytes() const noexcept;

 private:
    LearnedAffineFit fit_;
    AffineParts maps_;
    std::vector<int> box_places_;  // of box_samples: their first coordinates in the positions
    std::vector<float> grid_;      // [parts] resolution of the samples' rest positions, metres
    int parts_of_ = 0;
};

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
