#include "training/calibrate/bound_levels.hpp"

#include <algorithm>

namespace nbd {

BoundLevels::BoundLevels(const SphereTree& tree) {
    for (int depth = 0; depth <= tree.depth(); ++depth)
        begins.push_back(std::ranges::lower_bound(tree.nodes, depth, {}, &SphereTree::Node::depth) -
                         tree.nodes.begin());
    begins.push_back(tree.nodes.size());
}

BoundLevels::BoundLevels(const CollisionTree& tree, BoundKind kind) : BoundLevels(tree.spheres) {
    if (kind == BoundKind::learned_affine && tree.learned_affine) begins = tree.learned_affine->levels();
}

}  // namespace nbd
