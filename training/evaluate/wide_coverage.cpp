#include "training/evaluate/wide_coverage.hpp"

#include <algorithm>
#include <limits>

namespace nbd {
namespace {

double diagonal(const Box& box) { return double{(box.hi - box.lo).matrix().norm()}; }

LearnedAffineBoxes calibrated(const CollisionTree& tree) {
    const Calibration& calibration = tree.calibrations.at(BoundKind::learned_affine);
    return {tree.learned_affine, {calibration.margins, calibration.limits}};
}

}  // namespace

WideCoverage::WideCoverage(const CollisionTree& tree)
    : model_(tree.boxes ? tree.boxes : make_boxes(tree)),
      tree_(&model_->tree()),
      boxes_(model_, calibrated(tree)),
      learned_(calibrated(tree)) {}

WideCoverage::Node WideCoverage::cluster(int i) const {
    const auto c = static_cast<std::size_t>(i);
    return {exact_.clusters[c], tree_width * tree_->first_block[c], tree_width * tree_->first_block[c + 1]};
}
WideCoverage::Node WideCoverage::block(int i) const {
    return {exact_.blocks[static_cast<std::size_t>(i)], tree_width * i, tree_width * (i + 1)};
}
WideCoverage::Node WideCoverage::leaf(int i) const {
    return {exact_.leaves[static_cast<std::size_t>(i)], i, i + 1};
}

void WideCoverage::add(const Box& box, const Node& node, VerticesRef x, WideOutcome& outcome) const {
    outcome.inflation +=
        diagonal(box) / std::max(diagonal(node.exact), double{std::numeric_limits<float>::min()}) - 1;
    const bool protrudes = nbd::outside(box, node.exact) > 0;
    for (int i = node.first_leaf; i < node.end_leaf; ++i) {
        const std::span<const int> vertices = tree_->leaf_vertices(i);
        outcome.vertices += static_cast<long>(vertices.size());
        if (!protrudes) continue;
        for (const int v : vertices) {
            const Eigen::Array3f p = x.row(v).transpose();
            outcome.outside += !((p >= box.lo.head<3>()).all() && (p <= box.hi.head<3>()).all());
        }
    }
}

std::span<const WideOutcome> WideCoverage::measure(VerticesRef x) {
    fit_wide_boxes(*tree_, x, exact_);
    outcomes_.clear();
    boxes_.begin_pose(VertexView::as_long_as(x));
    // The boxes do not tell which of them are out of range, so they are asked for a second time.
    x_ = x;
    learned_.begin_pose(x_.data());
    for (int i = 0; i < tree_->clusters(); ++i) {
        Box box;
        WideOutcome& outcome =
            outcomes_.emplace_back(WideOutcome{.level = 0, .out_of_range = !learned_.box(i, box)});
        add(boxes_.cluster(i), cluster(i), x, outcome);
    }
    const auto add_children = [&](int level, bool in_range, const BoxPack& boxes, int first, int count,
                                  const auto& node) {
        WideOutcome& outcome = outcomes_.emplace_back(WideOutcome{.level = level, .out_of_range = !in_range});
        for (int k = 0; k < count; ++k) add(boxes.box(k), node(first + k), x, outcome);
        outcome.inflation /= count;
    };
    BoxPack pack;
    for (int i = 0; i < tree_->clusters(); ++i)
        add_children(1, learned_.blocks(i, pack), boxes_.blocks(i).boxes,
                     tree_->first_block[static_cast<std::size_t>(i)], tree_->blocks_in(i),
                     [&](int k) { return block(k); });
    for (int i = 0; i < tree_->blocks(); ++i)
        add_children(2, learned_.leaves(i, pack), boxes_.leaves(i).boxes, tree_width * i,
                     tree_->leaves_in[static_cast<std::size_t>(i)], [&](int k) { return leaf(k); });
    return outcomes_;
}

}  // namespace nbd
