#include "collision/bounds/affine/wide_boxes.hpp"

namespace nbd {

void fit_wide_boxes(const WideTree& tree, VerticesRef x, WideBoxes& boxes) {
    boxes.clusters.assign(tree.clusters(), empty_box());
    boxes.blocks.assign(tree.blocks(), empty_box());
    boxes.leaves.assign(tree.leaves(), empty_box());
    for (int leaf = 0; leaf < tree.leaves(); ++leaf) {
        Box& box = boxes.leaves[leaf];
        for (const int v : tree.leaf_vertices(leaf)) {
            const Eigen::Array4f p(x(v, 0), x(v, 1), x(v, 2), 0);
            box = joined(box, {p, p});
        }
        Box& block = boxes.blocks[static_cast<std::size_t>(leaf / tree_width)];
        block = joined(block, box);
    }
    for (std::size_t block = 0; block < boxes.blocks.size(); ++block) {
        Box& cluster = boxes.clusters[tree.cluster_of[block]];
        cluster = joined(cluster, boxes.blocks[block]);
    }
}

}  // namespace nbd
