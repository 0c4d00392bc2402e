#include "collision/local_boxes.hpp"

#include <cmath>
#include <utility>

namespace nbd {

static_assert(Bound<LocalBoxes>);

SampleBox sample_box(const LocalModel& model, int node, const Positions& x) noexcept {
    const LocalModel::Node& n = model.nodes[static_cast<std::size_t>(node)];
    const LocalModel::BoxFit& fit = model.boxes[static_cast<std::size_t>(node)];
    const int *rows = model.samples.data() + n.sample_begin, *end = rows + n.sample_count;
    // Offsets from the first sample keep their digits far from the origin. Two chains of each, since every
    // step waits for the one before.
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
    const auto count = static_cast<float>(n.sample_count);
    const Eigen::Array4f mean = (sum[0] + sum[1]) / count,
                         squared = (squares[0] + squares[1]) / count - mean * mean;
    SampleBox result{{lo[0].min(lo[1]), hi[0].max(hi[1])}};
    result.box.lo[3] = result.box.hi[3] = 0;
    const float squared_spread = squared[0] + squared[1] + squared[2];
    result.spread = std::sqrt(std::max(squared_spread, 0.f));
    if (!n.exact) result.strangeness = std::abs(squared_spread - fit.mean) * fit.inverse_deviation;
    return result;
}

LocalBoxes::LocalBoxes(const SphereTree& tree, const LocalModel& model, Trust trust)
    : tree_(&tree), model_(&model), trust_(std::move(trust)), entries_(tree.nodes.size(), {empty_box()}) {}

void LocalBoxes::begin_pose(const Positions& x) noexcept {
    x_ = x;
    ++pose_;
    bounded_ = 0;
    out_of_range_ = 0;
}

Box LocalBoxes::compute(int node) noexcept {
    const auto i = static_cast<std::size_t>(node);
    const LocalModel::Node& n = model_->nodes[i];
    x_.require(model_->node_samples(node));
    const SampleBox samples = sample_box(*model_, node, x_);
    if (n.exact) return samples.box;
    float margin = trust_.margins[i];
    if (!trust_.limits.empty()) {
        // Not a number is out of range too.
        if (!(samples.strangeness <= trust_.limits[i])) {
            ++out_of_range_;
            x_.require(tree_->node_vertices(node));
            return bounding_box(x_, tree_->node_vertices(node));
        }
        margin *= margin_weight(samples.strangeness, trust_.limits[i]);
    }
    const float growth = (model_->boxes[i].growth + margin) * samples.spread;
    const Eigen::Array4f outward = Eigen::Array4f(1, 1, 1, 0) * growth;
    return {samples.box.lo - outward, samples.box.hi + outward};
}

}  // namespace nbd
