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
            if (count <= leaf_faces) {
                nodes_[i].leaf = static_cast<int>(face_boxes_.size());
                face_boxes_.emplace_back();
                continue;
            }
            nodes_[i].first_child = static_cast<int>(nodes_.size());
            nodes_.push_back({.face_begin = node.face_begin, .face_end = middle});
            nodes_.push_back({.face_begin = middle, .face_end = node.face_end});
        }
        ranges_[leaf].end = static_cast<int>(nodes_.size());
    }
    boxes_.assign(nodes_.size(), empty_box());
    corners_ = tree.faces(tree.spheres.faces, Eigen::all);
}

void LeafBoxes::begin_pose(const Positions& x) noexcept {
    x_ = x;
    ++pose_;
}

Box LeafBoxes::refit_faces(const Node& leaf) noexcept {
    std::array<Box, FaceBoxes::lanes> boxes;
    boxes.fill(empty_box());
    Box all = empty_box();
    for (int slot = leaf.face_begin; slot < leaf.face_end; ++slot) {
        const Eigen::Array4f a = x_[corners_(slot, 0)], b = x_[corners_(slot, 1)], c = x_[corners_(slot, 2)];
        Box& box = boxes[static_cast<std::size_t>(slot - leaf.face_begin)];
        box = {a.min(b).min(c), a.max(b).max(c)};
        all = joined(all, box);
    }
    face_boxes_[static_cast<std::size_t>(leaf.leaf)] = FaceBoxes(boxes);
    all.lo[3] = all.hi[3] = 0;
    return all;
}

int LeafBoxes::refit(int leaf) noexcept {
    if (poses_[static_cast<std::size_t>(leaf)] == pose_) return 0;
    poses_[static_cast<std::size_t>(leaf)] = pose_;
    x_.require(tree_->spheres.node_vertices(leaf));
    const auto [begin, end] = ranges_[static_cast<std::size_t>(leaf)];
    for (int i = end; i-- > begin;) {
        const Node& n = node(i);
        boxes_[static_cast<std::size_t>(i)] =
            n.is_leaf() ? refit_faces(n) : joined(box(n.first_child), box(n.first_child + 1));
    }
    return end - begin;
}

}  // namespace nbd
