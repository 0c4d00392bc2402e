#include "collision/bounds/learned/nbd_bound.hpp"

#include <algorithm>
#include <cmath>
#include <span>

namespace nbd {

static_assert(GatedBound<NbdBound> && NbdNetworks::max_at_once >= 2);

NbdBound::NbdBound(const SphereTree& tree, const NbdModel& model)
    : tree_(&tree),
      model_(&model),
      z_(Eigen::VectorXf::Zero(model.mode_count())),
      zn_(model.mode_count()),
      difference_(z_),
      whitened_(z_) {
    scratch_.fit(model.modes.X.rows());
    const std::vector<int>& representatives = model.modes.representatives;
    const int vertex_count = tree.vertices.empty() ? 0 : std::ranges::max(tree.vertices) + 1;
    std::vector<int> row_of(vertex_count, -1);
    for (std::size_t k = 0; k < representatives.size(); ++k)
        if (representatives[k] < vertex_count) row_of[representatives[k]] = k;
    for (const int v : tree.vertices) {
        seen_begin_.push_back(seen_.size());
        if (const int row = row_of[v]; row >= 0) seen_.push_back(row);
    }
    seen_begin_.push_back(seen_.size());
}

void NbdBound::begin_pose(VerticesRef x) noexcept {
    align_ = modal_coordinates(model_->modes, x, scratch_, z_);
    zn_.numbers() = (z_ - model_->z_centre).cwiseProduct(model_->z_scale);
    zn_.fix();
    pose_ood_score_ = -1;
    first_ = -1;
}

float NbdBound::ood_score(int node) noexcept {
    if (!(pose_ood_score_ >= 0))
        pose_ood_score_ =
            coordinate_ood_score(model_->z_mean, model_->z_whitening, zn_.numbers(), difference_, whitened_);
    return nbd_ood_score(pose_ood_score_, outside(node));
}

float NbdBound::outside(int node) const noexcept {
    const SphereTree::Node& n = tree_->nodes[node];
    const std::size_t begin = seen_begin_[n.vertex_begin], end = seen_begin_[n.vertex_end];
    float squared = last_.r * last_.r;
    for (const int row : std::span(seen_).subspan(begin, end - begin))
        squared = std::max(squared, (scratch_.x.row(row).transpose() - last_.c).squaredNorm());
    float outside = 0 * (last_.c.sum() + last_.r);  // NaN if the sphere is not finite
    if (squared > last_.r * last_.r) outside = std::sqrt(squared) / last_.r - 1;
    return outside;
}

}  // namespace nbd
