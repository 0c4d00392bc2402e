#include "collision/leaf_boxes.hpp"

namespace nbd {

LeafBoxes::LeafBoxes(const CollisionTree& tree)
    : tree_(&tree), ranges_(tree.spheres.nodes.size()), poses_(tree.spheres.nodes.size(), 0) {
    for (std::size_t leaf = 0; leaf < ranges_.size(); ++leaf) {
        const SphereTree::Node& sphere_node = tree.spheres.nodes[leaf];
        if (!sphere_node.is_leaf()) continue;
        ranges_[leaf].begin = static_cast<int>(nodes_.size());
        nodes_.push_back({.face_begin = sphere_node.face_begin, .face_end = sphere_node.face_end});
        for (auto i = static_cast<std::size_t>(ranges_[leaf].begin); i < nodes_.size(); ++i) {
            const Node node = nodes_[i];
            const int count = node.face_end - node.face_begin, middle = node.face_begin + count / 2;
            if (count <= leaf_faces) continue;
            nodes_[i].first_child = static_cast<int>(nodes_.size());
            nodes_.push_back({.face_begin = node.face_begin, .face_end = middle});
            nodes_.push_back({.face_begin = middle, .face_end = node.face_end});
        }
        ranges_[leaf].end = static_cast<int>(nodes_.size());
    }
    boxes_.assign(nodes_.size(), empty_box());
}

void LeafBoxes::begin_pose(VerticesRef x) noexcept {
    x_ = x.data();
    stride_ = x.outerStride();
    ++pose_;
}

int LeafBoxes::refit(int leaf) noexcept {
    if (poses_[static_cast<std::size_t>(leaf)] == pose_) return 0;
    poses_[static_cast<std::size_t>(leaf)] = pose_;
    const auto [begin, end] = ranges_[static_cast<std::size_t>(leaf)];
    for (int i = end; i-- > begin;) {
        const Node& n = node(i);
        Box fitted;
        if (n.is_leaf()) {
            fitted = bounding_box(triangle(n.face_begin));
            for (int slot = n.face_begin + 1; slot < n.face_end; ++slot)
                fitted = joined(fitted, bounding_box(triangle(slot)));
        } else {
            fitted = joined(box(n.first_child), box(n.first_child + 1));
        }
        boxes_[static_cast<std::size_t>(i)] = fitted;
    }
    return end - begin;
}

}  // namespace nbd
