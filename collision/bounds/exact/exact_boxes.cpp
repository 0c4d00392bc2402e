#include "collision/bounds/exact/exact_boxes.hpp"

#include <algorithm>

#include "collision/geometry/bounding_box.hpp"

namespace nbd {
static_assert(Bound<ExactBoxes>);

ExactBoxes::ExactBoxes(const SphereTree& tree) : tree_(&tree), boxes_(tree.nodes.size(), empty_box()) {
    for (std::size_t i = 0; i < tree.nodes.size(); ++i) {
        if (!tree.nodes[i].is_leaf()) continue;
        const std::size_t begin = rows_.size();
        const std::span<const int> vertices = tree.node_vertices(i);
        rows_.insert(rows_.end(), vertices.begin(), vertices.end());
        std::sort(rows_.begin() + static_cast<std::ptrdiff_t>(begin), rows_.end());
        leaves_.push_back({static_cast<int>(i), begin, rows_.size()});
    }
}

void ExactBoxes::begin_pose(const Positions& x) noexcept {
    met_non_finite_ = false;
    for (const Leaf& leaf : leaves_) {
        Box& box = boxes_[leaf.node];
        box = bounding_box(x, std::span(rows_).subspan(leaf.begin, leaf.end - leaf.begin));
        met_non_finite_ |= !is_finite(box);
    }
    for (std::size_t i = tree_->nodes.size(); i-- > 0;) {
        const SphereTree::Node& node = tree_->nodes[i];
        if (!node.is_leaf()) boxes_[i] = joined(box(node.first_child), box(node.first_child + 1));
    }
}

Sphere ExactBoxes::bound(int node) const noexcept { return sphere_around(box(node)); }

}  // namespace nbd
