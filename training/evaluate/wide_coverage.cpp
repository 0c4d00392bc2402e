#include "training/evaluate/wide_coverage.hpp"

#include <algorithm>
#include <limits>

namespace nbd {
namespace {

NodeMargins calibrated(const CollisionTree& tree) {
    const Calibration& calibration = tree.calibrations.at(BoundKind::learned_affine);
    return {calibration.margins, calibration.limits};
}

}  // namespace

double diagonal(const Box& box) noexcept { return double{(box.hi - box.lo).matrix().norm()}; }

WideNodes::WideNodes(const CollisionTree& tree, const NodeMargins& margins)
    : model_(tree.boxes ? tree.boxes : make_boxes(tree)),
      tree_(&model_->tree()),
      boxes_(model_, LearnedAffineBoxes(tree.learned_affine, margins)),
      learned_(tree.learned_affine, margins) {}

std::span<const WideNode> WideNodes::pose(VerticesRef x) {
    fit_wide_boxes(*tree_, x, exact_);
    nodes_.clear();
    boxes_.begin_pose(VertexView::as_long_as(x));
    // The boxes do not tell which of them are out of range, so they are asked for a second time.
    x_ = x;
    learned_.begin_pose(x_.data());
    int bound = 0;
    for (int i = 0; i < tree_->clusters(); ++i) {
        const std::size_t c = i;
        Box box;
        const bool in_range = learned_.box(i, box);
        nodes_.push_back({.level = 0,
                          .bound = bound++,
                          .out_of_range = !in_range,
                          .box = boxes_.cluster(i),
                          .exact = exact_.clusters[c],
                          .first_leaf = tree_width * tree_->first_block[c],
                          .end_leaf = tree_width * tree_->first_block[c + 1]});
    }
    BoxPack pack;
    for (int i = 0; i < tree_->clusters(); ++i, ++bound) {
        const bool in_range = learned_.blocks(i, pack);
        const int first = tree_->first_block[i];
        for (int k = 0; k < tree_->blocks_in(i); ++k)
            nodes_.push_back({.level = 1,
                              .bound = bound,
                              .out_of_range = !in_range,
                              .box = boxes_.blocks(i).boxes.box(k),
                              .exact = exact_.blocks[first + k],
                              .first_leaf = tree_width * (first + k),
                              .end_leaf = tree_width * (first + k + 1)});
    }
    for (int i = 0; i < tree_->blocks(); ++i, ++bound) {
        const bool in_range = learned_.leaves(i, pack);
        for (int k = 0; k < tree_->leaves_in[i]; ++k) {
            const int leaf = tree_width * i + k;
            nodes_.push_back({.level = 2,
                              .bound = bound,
                              .out_of_range = !in_range,
                              .box = boxes_.leaves(i).boxes.box(k),
                              .exact = exact_.leaves[leaf],
                              .first_leaf = leaf,
                              .end_leaf = leaf + 1});
        }
    }
    return nodes_;
}

long WideNodes::vertices(const WideNode& node) const {
    long count = 0;
    for (int i = node.first_leaf; i < node.end_leaf; ++i)
        count += static_cast<long>(tree_->leaf_vertices(i).size());
    return count;
}

long WideNodes::outside(const WideNode& node, const Box& box, VerticesRef x) const {
    if (!(nbd::outside(box, node.exact) > 0)) return 0;
    long count = 0;
    for (int i = node.first_leaf; i < node.end_leaf; ++i)
        for (const int v : tree_->leaf_vertices(i)) {
            const Eigen::Array3f p = x.row(v).transpose();
            count += !((p >= box.lo.head<3>()).all() && (p <= box.hi.head<3>()).all());
        }
    return count;
}

WideCoverage::WideCoverage(const CollisionTree& tree) : nodes_(tree, calibrated(tree)) {}

std::span<const WideOutcome> WideCoverage::measure(VerticesRef x) {
    outcomes_.clear();
    const std::span<const WideNode> nodes = nodes_.pose(x);
    for (auto begin = nodes.begin(); begin != nodes.end();) {
        const auto end = std::find_if(begin, nodes.end(),
                                      [&](const WideNode& node) { return node.bound != begin->bound; });
        WideOutcome& outcome =
            outcomes_.emplace_back(WideOutcome{.level = begin->level, .out_of_range = begin->out_of_range});
        for (auto node = begin; node != end; ++node) {
            outcome.inflation += diagonal(node->box) / std::max(diagonal(node->exact),
                                                                double{std::numeric_limits<float>::min()}) -
                                 1;
            outcome.vertices += nodes_.vertices(*node);
            outcome.outside += nodes_.outside(*node, node->box, x);
        }
        outcome.inflation /= static_cast<double>(end - begin);
        begin = end;
    }
    return outcomes_;
}

}  // namespace nbd
