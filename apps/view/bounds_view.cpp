#include "apps/view/bounds_view.hpp"

#include <algorithm>

namespace nbd {
namespace {

constexpr int deepest = 6;

}  // namespace

ViewBounds bounds_of(const PosedTree& tree) {
    const std::vector<SphereTree::Node>& nodes = tree.tree().spheres.nodes;
    ViewBounds bounds{std::string(name(tree.kind())), is_box(tree.kind()), {0}, {}};
    for (int node = 0; node < static_cast<int>(nodes.size()); ++node) {
        const int depth = nodes[static_cast<std::size_t>(node)].depth;
        if (depth > deepest) break;
        bounds.first_node.resize(static_cast<std::size_t>(depth) + 2);
        bounds.first_node.back() = node + 1;
    }
    return bounds;
}

void add_bounds(PosedTree& tree, ViewBounds& bounds) {
    for (int node = 0; node < bounds.first_node.back(); ++node) {
        if (bounds.are_boxes) {
            const Box box = *tree.box(node);
            for (const Eigen::Array4f& corner : {box.lo, box.hi})
                bounds.values.insert(bounds.values.end(), corner.data(), corner.data() + 3);
        } else {
            const Sphere& sphere = tree.sphere(node);
            bounds.values.insert(bounds.values.end(), sphere.c.data(), sphere.c.data() + 3);
            bounds.values.push_back(sphere.r);
        }
    }
}

}  // namespace nbd
