#include "apps/view/posed_view.hpp"

namespace nbd {
namespace {

constexpr int deepest_spheres = 6;       // of a sphere tree
constexpr std::size_t most_boxes = 512;  // of a wide tree

void add_box(const Box& box, std::vector<float>& values) {
    for (const Eigen::Array4f& corner : {box.lo, box.hi})
        values.insert(values.end(), corner.data(), corner.data() + 3);
}

/// Adds the numbers of nodes of levels of a wide tree, which are the same in all poses.
void count_boxes(const std::vector<std::vector<Box>>& levels, std::vector<int>& first_node) {
    if (first_node.size() > 1) return;
    for (const std::vector<Box>& level : levels) first_node.push_back(first_node.back() + level.size());
}

/// Whether the tree hangs on the nodes that poses give.
bool hangs_on_those_nodes(const ViewTree& body) {
    return body.tree->affine && body.W.rows() > 0 && body.tree->affine->node_count() == body.W.cols();
}

BoundKind drawn_bounds(const ViewTree& body) {
    if (!reads_nodes(body.bounds)) return body.bounds;
    return hangs_on_those_nodes(body) ? BoundKind::affine : BoundKind::boxes;
}

}  // namespace

PosedView::PosedView(ViewTree body) : body_(std::move(body)), exact_(body_.tree, BoundKind::boxes) {
    const BoundKind kind = drawn_bounds(body_);
    const bool takes_margin = can_miss(kind) || kind == BoundKind::exact;
    if (kind != BoundKind::boxes) own_.emplace(body_.tree, kind, takes_margin ? body_.margin : std::nullopt);
}

void PosedView::begin_pose(VerticesRef nodes) {
    if (body_.W.rows() > 0)
        apply_embedding(body_.W, nodes, x_);
    else
        x_ = nodes;
    exact_.begin_pose(x_);
    if (!own_) return;
    if (own_->takes_nodes()) {
        nodes_ = nodes;
        own_->begin_pose_of_nodes(nodes_);
    } else {
        own_->begin_pose(x_);
    }
}

ViewBounds bounds_of(PosedView& body) {
    const PosedTree& tree = body.own();
    const std::vector<SphereTree::Node>& nodes = tree.tree().spheres.nodes;
    ViewBounds bounds{std::string(name(tree.kind())), is_box(tree.kind()), {0}, {}};
    if (bounds.are_boxes) return bounds;
    for (int node = 0; node < std::ssize(nodes); ++node) {
        const int depth = nodes[node].depth;
        if (depth > deepest_spheres) break;
        bounds.first_node.resize(static_cast<std::size_t>(depth) + 2);
        bounds.first_node.back() = node + 1;
    }
    return bounds;
}

void add_bounds(PosedView& body, ViewBounds& bounds) {
    PosedTree& tree = body.own();
    if (bounds.are_boxes) {
        const auto levels = box_levels(tree.wide_tree(), most_boxes);
        count_boxes(levels, bounds.first_node);
        for (const std::vector<Box>& level : levels)
            for (const Box& box : level) add_box(box, bounds.values);
        return;
    }
    for (int node = 0; node < bounds.first_node.back(); ++node) {
        const Sphere& sphere = tree.sphere(node);
        bounds.values.insert(bounds.values.end(), sphere.c.data(), sphere.c.data() + 3);
        bounds.values.push_back(sphere.r);
    }
}

std::vector<std::vector<Box>> box_levels(PosedWideTree& boxes, std::size_t most) {
    const WideTree& tree = boxes.tree();
    std::size_t total = 1;
    const auto fits = [&](int count) { return (total += static_cast<std::size_t>(count)) <= most; };
    int leaf_count = 0;
    for (const std::uint8_t leaves : tree.leaves_in) leaf_count += leaves;
    std::vector<std::vector<Box>> levels{{boxes.whole()}};
    if (!fits(tree.clusters())) return levels;
    std::vector<Box>& clusters = levels.emplace_back();
    for (int c = 0; c < tree.clusters(); ++c) clusters.push_back(boxes.cluster(c));
    if (!fits(tree.blocks())) return levels;
    std::vector<Box>& blocks = levels.emplace_back();
    for (int c = 0; c < tree.clusters(); ++c)
        for (int b = 0; b < tree.blocks_in(c); ++b) blocks.push_back(boxes.blocks(c).boxes.box(b));
    if (!fits(leaf_count)) return levels;
    std::vector<Box>& leaves = levels.emplace_back();
    for (int b = 0; b < tree.blocks(); ++b)
        for (int l = 0; l < tree.leaves_in[b]; ++l) leaves.push_back(boxes.leaves(b).boxes.box(l));
    return levels;
}

}  // namespace nbd
