#include "collision/exact_boxes.hpp"

#include <algorithm>
#include <limits>

#include "collision/padded_positions.hpp"

namespace nbd {
namespace {

/// Four boxes at a time, since each minimum waits for the one before.
Box box_of(const PaddedPositions& x, const int* begin, const int* end) noexcept {
    constexpr int chains = 4;
    Box part[chains] = {empty_box(), empty_box(), empty_box(), empty_box()};
    const auto add = [&](Box& box, int row) {
        const Eigen::Array4f p = x[row];
        box.lo = box.lo.min(p);
        box.hi = box.hi.max(p);
    };
    for (; end - begin >= chains; begin += chains)
        for (int c = 0; c < chains; ++c) add(part[c], begin[c]);
    for (; begin < end; ++begin) add(part[0], *begin);
    Box box = joined(joined(part[0], part[1]), joined(part[2], part[3]));
    box.lo[3] = box.hi[3] = 0;
    return box;
}

}  // namespace

static_assert(Bound<ExactBoxes>);

ExactBoxes::ExactBoxes(const SphereTree& tree) : tree_(&tree), boxes_(tree.nodes.size(), empty_box()) {
    for (std::size_t i = 0; i < tree.nodes.size(); ++i) {
        if (!tree.nodes[i].is_leaf()) continue;
        const std::size_t begin = rows_.size();
        const std::span<const int> vertices = tree.node_vertices(static_cast<int>(i));
        rows_.insert(rows_.end(), vertices.begin(), vertices.end());
        std::sort(rows_.begin() + static_cast<std::ptrdiff_t>(begin), rows_.end());
        leaves_.push_back({static_cast<int>(i), begin, rows_.size()});
    }
}

void ExactBoxes::begin_pose(VerticesRef x) noexcept {
    const PaddedPositions positions(x);
    for (const Leaf& leaf : leaves_)
        boxes_[static_cast<std::size_t>(leaf.node)] =
            box_of(positions, rows_.data() + leaf.begin, rows_.data() + leaf.end);
    for (std::size_t i = tree_->nodes.size(); i-- > 0;) {
        const SphereTree::Node& node = tree_->nodes[i];
        if (!node.is_leaf()) boxes_[i] = joined(box(node.first_child), box(node.first_child + 1));
    }
}

Sphere ExactBoxes::bound(int node) const noexcept {
    // Middle and half diagonal round by a few ulp, the middle of coordinates that may be large beside the
    // box.
    constexpr float ulp = std::numeric_limits<float>::epsilon();
    const Eigen::Array4f &lo = box(node).lo, &hi = box(node).hi;
    const Eigen::Array4f centre = (lo + hi) / 2, half = (hi - centre).max(centre - lo);
    const float far = std::max(lo.abs().maxCoeff(), hi.abs().maxCoeff());
    return {centre.head<3>().matrix(), half.matrix().norm() * (1 + 4 * ulp) + 2 * ulp * far};
}

}  // namespace nbd
