#include "collision/leaf_boxes.hpp"

namespace nbd {
namespace {

/// How often `count` faces are halved until no more than eight are left.
int halvings(int count) noexcept {
    int n = 0;
    for (; count > LeafBoxes::lanes; count = (count + 1) / 2) ++n;
    return n;
}

}  // namespace

LeafBoxes::LeafBoxes(const CollisionTree& tree)
    : tree_(&tree), ranges_(tree.spheres.nodes.size()), poses_(tree.spheres.nodes.size(), 0) {
    for (std::size_t leaf = 0; leaf < ranges_.size(); ++leaf) {
        const SphereTree::Node& sphere_node = tree.spheres.nodes[leaf];
        if (!sphere_node.is_leaf()) continue;
        ranges_[leaf].begin = static_cast<int>(nodes_.size());
        add_nodes(sphere_node.face_begin, sphere_node.face_end);
        ranges_[leaf].end = static_cast<int>(nodes_.size());
    }
    boxes_.resize(nodes_.size());
    wholes_.assign(nodes_.size(), empty_box());
    corners_ = tree.faces(tree.spheres.faces, Eigen::all);
}

void LeafBoxes::add_nodes(int face_begin, int face_end) {
    std::size_t next = nodes_.size();
    nodes_.push_back({.first_slot = face_begin, .count = face_end - face_begin});
    for (; next < nodes_.size(); ++next) {
        const Node whole = nodes_[next];
        const int left = halvings(whole.count);
        if (left == 0) continue;
        // Eight children but for the topmost node, so that the lowest ones are full.
        const int parts = 1 << (left % 3 == 0 ? 3 : left % 3);
        nodes_[next].first_child = static_cast<int>(nodes_.size());
        nodes_[next].count = parts;
        add_parts(whole.first_slot, whole.first_slot + whole.count, parts);
    }
}

/// A node for each of `parts` parts, a power of 2, that halvings make.
void LeafBoxes::add_parts(int face_begin, int face_end, int parts) {
    if (parts == 1) {
        nodes_.push_back({.first_slot = face_begin, .count = face_end - face_begin});
        return;
    }
    const int middle = face_begin + (face_end - face_begin) / 2;
    add_parts(face_begin, middle, parts / 2);
    add_parts(middle, face_end, parts / 2);
}

void LeafBoxes::begin_pose(const Positions& x) noexcept {
    x_ = x;
    ++pose_;
}

/// Fits the boxes of a node whose children are done.
void LeafBoxes::refit_node(int i) noexcept {
    const Node& n = node(i);
    std::array<Box, lanes> boxes;
    boxes.fill(empty_box());
    Box all = empty_box();
    for (int k = 0; k < n.count; ++k) {
        Box& box = boxes[static_cast<std::size_t>(k)];
        if (n.has_faces()) {
            const int* v = corners(n.first_slot + k);
            const Eigen::Array4f a = x_[v[0]], b = x_[v[1]], c = x_[v[2]];
            box = {a.min(b).min(c), a.max(b).max(c)};
        } else {
            box = whole(n.first_child + k);
        }
        all = joined(all, box);
    }
    boxes_[static_cast<std::size_t>(i)] = BoxPack(boxes);
    all.lo[3] = all.hi[3] = 0;
    wholes_[static_cast<std::size_t>(i)] = all;
}

int LeafBoxes::refit(int leaf) noexcept {
    if (poses_[static_cast<std::size_t>(leaf)] == pose_) return 0;
    poses_[static_cast<std::size_t>(leaf)] = pose_;
    x_.require(tree_->spheres.node_vertices(leaf));
    const auto [begin, end] = ranges_[static_cast<std::size_t>(leaf)];
    for (int i = end; i-- > begin;) refit_node(i);
    return end - begin;
}

}  // namespace nbd
