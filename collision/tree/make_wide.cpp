#include "collision/tree/make_wide.hpp"

#include <utility>

namespace nbd {

AffineBoxes make_wide(const CollisionTree& tree, BoundKind kind, std::optional<float> margin) {
    std::optional<LearnedAffineBoxes> learned;
    if (kind == BoundKind::learned_affine)
        learned.emplace(tree.learned_affine, node_margins(tree, kind, margin));
    return AffineBoxes(tree.boxes ? tree.boxes : make_boxes(tree), std::move(learned));
}

}  // namespace nbd
