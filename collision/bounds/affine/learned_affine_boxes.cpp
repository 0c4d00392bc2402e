#include "collision/bounds/affine/learned_affine_boxes.hpp"

#include <utility>

#include "collision/bounds/bound.hpp"

namespace nbd {

LearnedAffineBoxes::LearnedAffineBoxes(std::shared_ptr<const LearnedAffineModel> model, NodeMargins margins)
    : model_(std::move(model)), margins_(std::move(margins)) {}

float LearnedAffineBoxes::margin(int bound, float ood_score) noexcept {
    const std::size_t i = bound;
    if (margins_.limits.empty()) return margins_.margins[i];
    const float limit = margins_.limits[i];
    if (ood_score <= limit) return margins_.margins[i] * margin_weight(ood_score, limit);
    ++out_of_range_;  // a NaN score is out of range too
    return -1;
}

bool LearnedAffineBoxes::box(int cluster, Box& box) noexcept {
    const ClusterSamples samples = model_->cluster_samples(cluster, x_);
    met_non_finite_ |= !std::isfinite(samples.spread);
    const float by = margin(cluster, model_->cluster_score(cluster, samples.spread));
    if (by < 0) return false;
    const float growth = model_->fit().clusters[cluster].growth;
    const Eigen::Array4f outward = Eigen::Array4f(1, 1, 1, 0) * ((growth + by) * samples.spread);
    box = {samples.box.lo - outward, samples.box.hi + outward};
    return true;
}

bool LearnedAffineBoxes::children(int part, BoxPack& boxes) noexcept {
    const float residual = model_->map_children(part, x_, scratch_.data(), boxes);
    met_non_finite_ |= !std::isfinite(residual);
    const float by = margin(model_->clusters() + part, model_->part_score(part, residual));
    if (by < 0) return false;
    model_->grow(part, by, residual, boxes);
    return true;
}

}  // namespace nbd
