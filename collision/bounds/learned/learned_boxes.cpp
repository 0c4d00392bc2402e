#include "collision/bounds/learned/learned_boxes.hpp"

#include <algorithm>
#include <cmath>

namespace nbd {

static_assert(Bound<LearnedBoxes>);

namespace {

SampleBox sample_box(std::span<const int> samples, const BoxFit& fit, bool exact,
                     const Positions& x) noexcept {
    const int *rows = samples.data(), *end = rows + samples.size();
    // Offsets from the first sample keep their digits far from the origin. Two sums of each run in
    // parallel, since each addition waits for the one before.
    const Eigen::Array4f first = x[*rows];
    Eigen::Array4f lo[2] = {first, first}, hi[2] = {first, first};
    Eigen::Array4f sum[2] = {Eigen::Array4f::Zero(), Eigen::Array4f::Zero()}, squares[2] = {sum[0], sum[0]};
    for (; rows != end; rows += 2)
        for (int c = 0; c < 2; ++c) {
            const Eigen::Array4f p = x[rows[c]], q = p - first;
            lo[c] = lo[c].min(p);
            hi[c] = hi[c].max(p);
            sum[c] += q;
            squares[c] += q * q;
        }
    const auto count = static_cast<float>(samples.size());
    const Eigen::Array4f mean = (sum[0] + sum[1]) / count,
                         squared = (squares[0] + squares[1]) / count - mean * mean;
    SampleBox result{{lo[0].min(lo[1]), hi[0].max(hi[1])}};
    result.box.lo[3] = result.box.hi[3] = 0;
    const float squared_spread = squared[0] + squared[1] + squared[2];
    result.spread = std::sqrt(std::max(squared_spread, 0.f));
    if (!exact) result.ood_score = fit.ood_score(squared_spread);
    return result;
}

}  // namespace

SampleBox sample_box(const LearnedModel& model, int node, const Positions& x) noexcept {
    const auto i = static_cast<std::size_t>(node);
    return sample_box(model.node_samples(node), model.boxes[i], model.nodes[i].exact, x);
}

LearnedBoxes::LearnedBoxes(const SphereTree& tree, const LearnedModel& model, const NodeMargins& margins)
    : tree_(&tree), model_(&model), nodes_(tree.nodes.size()) {
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
        const LearnedModel::Node& n = model.nodes[i];
        nodes_[i] = {.fit = model.boxes[i],
                     .margin = margins.margins[i],
                     .limit = margins.limits.empty() ? -1 : margins.limits[i],
                     .sample_begin = n.sample_begin,
                     .sample_count = static_cast<std::int16_t>(n.sample_count),
                     .exact = n.exact};
    }
}

void LearnedBoxes::begin_pose(const Positions& x) noexcept {
    x_ = x;
    bounded_ = 0;
    out_of_range_ = 0;
    met_non_finite_ = false;
    if (++pose_ != 0) return;
    for (Node& n : nodes_) n.pose = 0;  // the pose counter wrapped around
    pose_ = 1;
}

Box LearnedBoxes::compute(int node, const Node& n) noexcept {
    x_.require(samples_of(n));
    const SampleBox samples = sample_box(samples_of(n), n.fit, n.exact, x_);
    met_non_finite_ |= !std::isfinite(samples.spread);
    if (n.exact) return samples.box;
    float margin = n.margin;
    if (n.limit >= 0) {
        // A NaN score is out of range too.
        if (!(samples.ood_score <= n.limit)) {
            ++out_of_range_;
            x_.require(tree_->node_vertices(node));
            const Box exact = bounding_box(x_, tree_->node_vertices(node));
            met_non_finite_ |= !is_finite(exact);
            return exact;
        }
        margin *= margin_weight(samples.ood_score, n.limit);
    }
    const float growth = (n.fit.growth + margin) * samples.spread;
    const Eigen::Array4f outward = Eigen::Array4f(1, 1, 1, 0) * growth;
    return {samples.box.lo - outward, samples.box.hi + outward};
}

}  // namespace nbd
